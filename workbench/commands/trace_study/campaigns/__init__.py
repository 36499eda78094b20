"""Campaigns whose truth is known, drawn from a seed.

draw        a whole campaign
cause, strength, misfit    what it lacks, and how strongly
excitation, play, noise    what is played, on which rig, and what sensors make of it
"""
