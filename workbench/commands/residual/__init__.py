"""`jackbench residual CAMPAIGN`: a rig's model beside the held-out records of a campaign folder."""
