"""`jackbench record RIG`: plays excitations on a rig in simulation and leaves a campaign folder."""
