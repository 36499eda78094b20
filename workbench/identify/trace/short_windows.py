"""Fits of effects with memory: in short windows first, then in whole ones.

A loop around a play hunts on it, and a window of a hunting loop is steep: initial states and numbers that are a little
off end far off, and no descent finds back. Over a quarter of a window it is not steep yet; numbers found there are so
near that whole windows, each begun where the one before ends, are followed from them. Where the short ones, or most
whole ones, are left worse than without the effect, they are not: a descent from there costs most and finds nothing.
"""

import numpy as np

from ...plant.effects import Effect
from ..fit.free_parameters import Candidate, at_strength, extend_parameters
from ..fit.initial_states import predicted_states
from ..fit.model import Model
from ..fit.normal_equations import costs, numbers_at
from ..fit.solver import Fit, fit_numbers, without_slopes
from ..fit.windows import Windows
from .problem import EstimationProblem

_PARTS = 4  # of a window
_STRENGTHS = (1.0, 0.3, 0.1, 0.03)  # of typical, from which the search starts
_TELLING = 6  # windows in which the start is sought
_WORSE = 1.5  # times the squared errors without the effect: from which on, in the middle window, nothing is near


def fit_short_windows_first(
    problem: EstimationProblem, base: Model, base_fit: Fit, model: Model, effect: Effect, rounds: int
) -> tuple[Candidate, Fit]:
    """The fit of `model`, which is the `base` with an effect, and the numbers that it started from."""
    worst = np.sort(np.argsort(-base_fit.squares, kind="stable")[:_TELLING])
    windows = problem.train.some(worst.tolist()).cut(_PARTS)
    x = np.zeros(len(base_fit.x)) if effect.rattles else base_fit.x
    before = extend_parameters(base.plant, numbers_at(base, base_fit.free, x, base_fit.p), model.plant)
    candidate, p, x0 = _start(model, windows, effect, before)
    more = candidate.free()
    free, start = (*base_fit.free, *more), np.append(x, np.zeros(len(more)))
    without = float(predicted_states(base, windows, base_fit.p)[1].sum())
    near = fit_numbers(model, windows, free, start, p, x0, problem.kappas, rounds, most=_WORSE * without)
    if not near.squares.sum() < without:
        x0 = model.starts(problem.train, near.p)
        squares = costs(model, problem.train, x0, near.p, x0)[1]
        return candidate, without_slopes(problem.train, free, near.x, near.p, x0, squares)
    x0, squares = predicted_states(model, problem.train, near.p)
    if not np.median(squares / base_fit.squares) < _WORSE:
        return candidate, without_slopes(problem.train, free, near.x, near.p, x0, squares)
    return candidate, fit_numbers(model, problem.train, free, near.x, near.p, x0, problem.kappas, rounds)


def _start(
    model: Model, windows: Windows, effect: Effect, before: np.ndarray
) -> tuple[Candidate, np.ndarray, np.ndarray]:
    """The strength at which the middle one of the windows is followed best, its parameters and initial states.

    Numbers that are fitted to the rig without the effect leave some windows hopeless at any strength.
    """
    trials = []
    for strength in _STRENGTHS[:1] if effect.rattles else _STRENGTHS:
        candidate = Candidate(effect, at_strength(effect, strength))
        numbers = {effect.key(name): value for name, value in candidate.start.items()}
        p = model.plant.parameter_values(before, **numbers)
        x0, squares = predicted_states(model, windows, p)
        trials.append((float(np.median(squares)), candidate, p, x0))
    return min(trials, key=lambda trial: trial[0])[1:]
