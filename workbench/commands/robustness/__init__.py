"""`jackbench robustness EXPERIMENT`: every controller on thousands of plants, drawn over what is uncertain of a rig.

options, config    what it is asked; the experiment file
draw               the plants
drawn_plants       the same with their operating points
linear_loops       poles and margins of all controllers on them, at several positions
study, page, linear_page    the steps on them and all rows; the report
"""
