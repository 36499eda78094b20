"""`jackbench inverse EXPERIMENT`: a designed inverse before a loop, and a loop that closes through its reference."""
