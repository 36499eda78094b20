"""`jackbench sines EXPERIMENT`: sines by loops alone, and with amplitude and phase control around them.

plants   the sines on drawn plants
"""
