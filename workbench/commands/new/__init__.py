"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller.

ask         a datasheet, asked for on the terminal
starter     the text of every file: the first gain follows from the rig
experiments the experiments, made of what their kinds declare
template    the other files of the folder, and what experiments begin with, with the rig's numbers left open
"""
