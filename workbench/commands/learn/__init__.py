"""`jackbench learn EXPERIMENT`: the drive file of a record that a loop plays again and again.

drawn      the same on drawn plants
measured   the closed loop's response, measured by a multisine
"""
