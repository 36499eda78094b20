"""`jackbench bench EXPERIMENT`: every controller on every rig of a set in every scenario.

entry      one controller on one rig in every scenario
figures    its figures
"""
