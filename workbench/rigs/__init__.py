"""What a rig is: its numbers with units, sources and bounds.

rig         a rig and its TOML file; the bundled ones are beside this file
schema      which numbers a rig has, by the kind of its valve and jack
datasheet   a rig from what makers say
"""
