"""`jackbench trust`: let code that comes with a rig or a campaign run."""
