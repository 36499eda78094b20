"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records."""
