"""`jackbench compare DIR DIR ...`: finished runs overlaid, with a table of differences.

finished    run folders, opened again
overlays    their curves in one figure
"""
