"""`jackbench new-rig DATASHEET.toml|SHEET.json`: a rig from a maker's numbers, or from a valve's own sheet.

sheet    a rig from the sheet of valve-test
"""
