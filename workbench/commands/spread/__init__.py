"""`jackbench spread EXPERIMENT`: overshoot of linear steps, one number of loop or rig varied at a time."""
