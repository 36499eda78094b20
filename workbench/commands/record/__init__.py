"""`jackbench record RIG`: plays excitations on a rig in simulation, or on a live one, and leaves a campaign folder.

live        what it does at a live rig
platform    what it records of a platform
"""
