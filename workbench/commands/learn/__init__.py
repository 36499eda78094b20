"""`jackbench learn EXPERIMENT`: the drive file of a record that a loop plays again and again.

drawn      the same on drawn plants
platform, platform_page    the same of a platform, in six axes at once
measured   the closed loop's response, measured by a multisine
"""
