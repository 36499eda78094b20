"""`jackbench inverse EXPERIMENT`: a designed inverse before a loop, and a loop that closes through its reference.

drawn      on drawn plants: the record as it is and filtered
"""
