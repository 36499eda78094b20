"""`jackbench compare DIR DIR ...`: finished runs overlaid, with a table of differences."""
