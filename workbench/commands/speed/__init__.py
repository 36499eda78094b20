"""`jackbench speed`: this engine beside public solvers, in one run."""
