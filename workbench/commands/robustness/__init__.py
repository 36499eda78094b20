"""`jackbench robustness EXPERIMENT`: every controller on thousands of plants, drawn over what is uncertain of a rig.

options, config    what it is asked; the experiment file
draw               the plants
study, page        the loops on them; the report
"""
