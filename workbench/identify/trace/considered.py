"""Pinned numbers that are not exactly known: what their error may do to the numbers that a fit finds.

A number with an `interval` and without bounds is not fitted, since the records tell it too badly, or another way. Its
error moves what is fitted all the same, to first order by -(J'J + P)^-1 J'K of slopes J to the fitted numbers and K to
the pinned ones, the initial states following: a consider covariance (Schmidt, Advances in Control Systems 3, 1966;
Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. 8).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...plant.effects import numbers_of
from ...rigs.rig import Rig
from ..fit.determined import FreeParameter
from ..fit.normal_equations import accumulate, held, slopes_of, stable
from .problem import EstimationProblem
from .refit import FittedModel

_NORMAL = 1.96  # standard deviations that half of an interval is


def considered(rig: Rig) -> tuple[FreeParameter, ...]:
    """The pinned numbers that have an interval; 1 is a standard deviation."""
    return tuple(
        FreeParameter(n.name, n.value, *n.interval, (n.interval[1] - n.interval[0]) / 2 / _NORMAL, "its interval")
        for n in numbers_of(rig).values()
        if n.interval is not None and n.low is None and n.interval[1] > n.interval[0]
    )


def with_considered(problem: EstimationProblem, found: FittedModel) -> FittedModel:
    """The fit whose covariance counts the errors that pinned numbers may have."""
    if not considered(problem.rig):
        return found
    _, carried = ToldNumbers(problem, found)()
    return replace(found, fit=replace(found.fit, covariance=found.fit.covariance + carried @ carried.T))


class ToldNumbers:
    """What the train windows tell of the numbers of a fit, beside pinned ones that may be off."""

    def __init__(self, problem: EstimationProblem, found: FittedModel) -> None:
        self._found, self._windows, pinned = found, problem.train, considered(problem.rig)
        fit, every = found.fit, (*found.fit.free, *pinned)
        x = np.append(fit.x, np.zeros(len(pinned)))
        self._slopes = [stable(whole) for whole in slopes_of(found.model, self._windows, fit.x0, fit.p, every, x)]

    def __call__(self, without: Sequence[str] = ()) -> tuple[np.ndarray, np.ndarray]:
        """Without some signals: the inverse [k, k] of the information on the fitted numbers, which their ranges hold,
        and how far [k, m] a standard deviation of each pinned number moves them."""
        fit, windows, k = self._found.fit, self._windows, len(self._found.fit.free)
        kept = np.array([name not in without for name in windows.names], float)
        own = [whole * np.tile(kept, whole.shape[1] // kept.size)[:, None] for whole in self._slopes]
        errors = [np.zeros_like(group.weight) for group in windows.groups]
        information = accumulate(self._found.model, windows, own, errors, fit.x0, fit.x0).reduced()[0].sum(axis=0)
        inverse = np.linalg.inv(information[:k, :k] + held(fit.free))
        return inverse, -inverse @ information[:k, k:]
