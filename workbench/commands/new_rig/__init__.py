"""`jackbench new-rig DATASHEET.toml`: a rig from a maker's numbers."""
