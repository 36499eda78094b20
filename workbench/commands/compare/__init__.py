"""`jackbench compare DIR DIR ...`: finished runs overlaid, with a table of differences.

finished    run folders, opened again
words       metrics with names, units, and what is no change
overlays    their curves in one figure
"""
