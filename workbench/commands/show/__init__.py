"""`jackbench show RIG`: every number of a rig, and what follows from them.

describe    the numbers and what follows from them; of a linear plant too
platform    the same of a platform on six jacks
rig_file    the rig as a TOML file
"""
