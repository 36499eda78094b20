"""`jackbench bench EXPERIMENT`: every controller on every rig of a set in every scenario."""
