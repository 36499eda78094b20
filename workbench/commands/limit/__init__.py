"""`jackbench limit EXPERIMENT`: the soonest that the known rig settles, the least error of a reference that moves."""
