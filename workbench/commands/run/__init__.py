"""`jackbench run EXPERIMENT`."""
