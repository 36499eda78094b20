"""Which column of a foreign recording is which signal of a rig: guesses with a reason each, and what is left open.

summary       what a column's numbers say: range, what is missing, whether it is a clock
conversion    what its unit and range say, beside the rig
guess         the column of each signal, or why none is
polarity      signs and pressures that changed places, by the rig's model
roles         which records are at rest, fitted, held out
"""
