"""`jackbench show RIG`: every number of a rig, and what follows from them."""
