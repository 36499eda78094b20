"""`jackbench limit EXPERIMENT`: the soonest that the known rig settles, the least error of a reference that moves.

steps    the scenarios of an experiment: at three places of the stroke, on every specimen of its rigs
"""
