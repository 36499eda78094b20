"""`jackbench faults EXPERIMENT`: what the guard makes of faults of sensors, controllers, drives and plants.

options    the experiment, and what the command is asked
fault_free         loops on drawn plants without a fault: does the guard trip?
study, page        all rows; the report (loop/fault_trial plays one fault, and counts what many came to)
"""
