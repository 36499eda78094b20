"""`jackbench robustness EXPERIMENT`: every controller on thousands of plants, drawn over what is uncertain of a rig.

options, config    what it is asked; the experiment file
draw               the plants
drawn_plants       the same with their operating points, block by block
linear_loops       poles and margins of all controllers on them, at several positions
workers            what a process does of a block of them: the loops at a place, the steps of a controller
kept               what is kept of the blocks
study, page, linear_page    all rows; the report
"""
