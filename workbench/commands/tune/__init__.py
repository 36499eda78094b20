"""`jackbench tune EXPERIMENT`: searches a controller's numbers and leaves tuned.toml, an experiment of the best.

The search itself is in loop/tuning.
"""
