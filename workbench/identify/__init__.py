"""A rig held against its recordings.

data        noise floor, whiteness, measured frequency response
fit         windows, models with their slopes, and the fit of a rig's numbers
trace       from a residual to the effect that the model lacks
datasheet   valves fitted to a maker's figures
"""
