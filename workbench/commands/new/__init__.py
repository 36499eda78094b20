"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller.

ask         a datasheet, or a label, asked for on the terminal
closed_loop a rig of which only the label is known, in the loop of its maker
starter     the text of every file: the first gain follows from the rig
experiments the experiments, made of what their kinds declare
template    the other files of the folder, and what experiments begin with, with the rig's numbers left open
"""
