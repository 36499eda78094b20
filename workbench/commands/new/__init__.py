"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller.

template    the files of the folder, with the rig's numbers left open
"""
