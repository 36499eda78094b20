"""`jackbench bench EXPERIMENT`: every controller on every rig of a set in every scenario.

entry         one controller on one rig in every scenario
envelope_row  one controller over the stroke, on every rig
verdict       which controller to take
figures       its figures
nichols       its Nichols charts
numbers       the numbers of controllers and rigs
"""
