"""A rig's numbers, fitted.

windows, model      records in short windows; a plant as a model of them, with exact slopes
rest_state, gap_guesses    where a free run begins whose jack rests; where in its gap what rattles may be
free_parameters, determined    what a fit may move, and what figures determine of it
normal_equations, initial_states, solver    the least squares problem and its solution
prior               ranges of numbers, and how far curves bend
rotation, informative, intervals    what windows say of a fit without them; which tell most; how far numbers are known
carried_noise       noise of measured inputs, as it comes out of a model
predict, repeats    what a model predicts of a record, in windows or free
sessions, session_numbers    groups of records that differ; numbers that are others in declared sessions
mistaken, mistakes  columns that are not what they are called; what may have happened, and how to undo it
checked_columns     what every command on a campaign does first: it refuses those
impossible, followed    what no recording of a rig has; what no closed loop does
late, unfelt        signals that another logger recorded later; a force that nothing on the rig makes
rehearsal, rests    a few windows fitted, to see what undoing a mistake brings; whether a found loop comes to rest
unexplained, servo  whether a fitted rig follows its records at all; how little a closed loop's may be

    from workbench.identify.fit import Model, cut_windows, fit_numbers, predicted_states, uncertain
    windows = cut_windows(plant, campaign.train, floor)           # 0.5 s each, with initial states of their own
    model = Model(plant, windows.names)                           # errors over sigma, and their slopes
    x0, squares = predicted_states(model, windows, plant.p)       # initial states [windows, n] for given numbers
"""

import lazy_loader

# What figures determine need not wait for the plant.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
