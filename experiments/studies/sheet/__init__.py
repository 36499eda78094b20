"""`python -m experiments.studies.sheet`: how often does a sheet's 95 % interval hold the truth, over drawn rigs.

drawn     a rig within the bounds of another; a line of a drawn rig beside its truth
valve     a valve on its bench, and in the records of a whole rig
force     a load cell
"""
