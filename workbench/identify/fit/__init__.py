"""A rig's numbers, fitted.

windows, model      records in short windows; a plant as a model of them, with exact slopes
free_parameters, determined    what a fit may move, and what figures determine of it
normal_equations, initial_states, solver    the least squares problem and its solution
predict, repeats    what a model predicts of a record, in windows or free
unexplained         whether a fitted rig follows its records at all
"""
