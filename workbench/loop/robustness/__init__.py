"""Every controller on thousands of plants, drawn over what is uncertain of a rig.

problem            what a study asks
plant_draw         drawn numbers and places; those of a study
drawn_plants       the same with their operating points, block by block
linear_loops       poles and margins of all controllers on them, at several positions
workers            what a process does of a block of them: the loops at a place, the steps of a controller
kept, row          what is kept of the blocks; one row of a controller over all of them
"""
