"""`jackbench tune EXPERIMENT`: searches a controller's numbers and leaves tuned.toml, an experiment of the best.

goals    hard goals in their order, then the cost
"""
