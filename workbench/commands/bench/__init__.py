"""`jackbench bench EXPERIMENT`: every controller on every rig of a set in every scenario.

entry         one controller on one rig in every scenario
envelope_row  one position controller over the stroke, on every free rig
verdict       which position controller to take
figures       its figures
nichols       its Nichols charts
numbers       the numbers of controllers and rigs
"""
