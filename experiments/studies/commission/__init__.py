"""`python -m experiments.studies.commission`: commissions hidden rigs behind the wire, and says what came out.

options          what it is asked
plan             which rigs are drawn: numbers, effects, noise, traps
benches          other benches: datasheets, tighter limits, missing channels, other periods
other_formulas   an effect file: the formulas that the library lacks, and a transducer of another scale
colour           noise that remembers
study            each rig served, commissioned, and judged beside a tuning that knows it
page             the report
"""

RIG = "jack-10t"  # whose numbers are drawn
