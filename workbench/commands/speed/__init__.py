"""`jackbench speed`: this engine beside public solvers, in one run.

start    what a command costs before it computes
"""
