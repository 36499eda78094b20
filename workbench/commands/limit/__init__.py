"""`jackbench limit EXPERIMENT`: the soonest that the known rig settles, whatever controls it.

steps    the steps of an experiment: at three places of the stroke, on every specimen of its rigs
"""
