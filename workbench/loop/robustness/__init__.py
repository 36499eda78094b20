"""Every controller on thousands of plants, drawn over what is uncertain of a rig.

problem            what a study asks
drawn_plants       drawn numbers and places; the same with their operating points, block by block
linear_loops       poles and margins of all controllers on them, at several positions
workers            what a process does of a block of them: the loops at a place, the steps of a controller
row                what is kept of the blocks; one row of a controller over all of them
"""
