"""`jackbench speed`: this engine beside public solvers, in one run.

loops    closed loops in Python, compiled and in batches
link     a rig behind the wire, beside an empty loop
"""
