"""Campaigns whose truth is known, drawn from a seed.

draw, scene    a whole campaign; its rig with what is played on it
cause, strength, misfit    what it lacks, and how strongly
programme, excitation, cycles    what is played on which rig
play, noise    the rig as it is played, and what sensors make of it
"""
