"""`jackbench speed`: this engine beside public solvers, in one run.

loops    closed loops in Python, compiled and in batches
start    what a command costs before it computes
link     a rig behind the wire, beside an empty loop
"""
