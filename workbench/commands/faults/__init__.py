"""`jackbench faults EXPERIMENT`: what the guard makes of faults of sensors, controllers, drives and plants.

options, config    what it is asked; the experiment file
played             one fault in one loop, from one of three moments
fault_free         loops on drawn plants without a fault: does the guard trip?
study, page        all rows; the report; counts: what faults came to
"""
