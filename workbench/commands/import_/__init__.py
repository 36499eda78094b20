"""`jackbench import FILE ... --rig RIG`: recordings as labs leave them, made a campaign folder.

tables      files converted to strict tables, and what their columns are
written     campaign.toml, with a line for every column that is left out
"""
