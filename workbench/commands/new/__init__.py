"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller.

ask         a datasheet, asked for on the terminal
starter     the text of every file: the first gain follows from the rig
template    the files of the folder, with the rig's numbers left open
"""
