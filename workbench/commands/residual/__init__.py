"""`jackbench residual CAMPAIGN`: a rig's model beside the held-out records of a campaign folder.

platform    of a platform, leg by leg
free_run    one run through a whole record, beside repeats of its command
"""
