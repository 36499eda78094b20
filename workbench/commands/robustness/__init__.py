"""`jackbench robustness EXPERIMENT`: every controller on thousands of plants, drawn over what is uncertain of a rig.

options    the experiment, and what the command is asked
study, page    all rows; the report
platform_study, platform_page    the same of a platform on six jacks

The plants, their loops and steps are in loop/robustness and loop/platform.
"""
