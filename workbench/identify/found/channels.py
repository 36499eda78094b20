"""What each recorded signal tells of a rig's numbers: how much longer their intervals would be without it."""

from collections.abc import Sequence

import numpy as np

from ..trace.considered import ToldNumbers
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel


def longer_without(problem: EstimationProblem, found: FittedModel, left_out: Sequence[Sequence[str]]) -> np.ndarray:
    """Intervals of the fitted numbers without some signals over those with all [sets, k]: by the information of the
    train windows about the fit, the initial states following, what pinned numbers may be off by counted."""
    told, noise = ToldNumbers(problem, found), problem.kappa * found.fit.louder

    def deviations(without: Sequence[str]) -> np.ndarray:
        inverse, carried = told(without)
        return np.sqrt(noise * np.diag(inverse) + (carried**2).sum(axis=1))

    return np.array([deviations(names) for names in left_out]) / deviations(())
