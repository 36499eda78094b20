"""`jackbench list rigs|controllers|effects|experiments`."""
