"""`jackbench commission RIG --at udp://HOST:PORT`: from a datasheet to a controller that is verified on the live rig.

options      what it is asked
transducers  an effect file: pressures that are read too large
rounds       what the records say, a controller for the rig as found, and whether that is enough
study        the whole way
results      commission.json, the controller as file, C and ST, the rig as found
page         the report
"""
