"""What each recorded signal tells of a rig's numbers: how much longer their intervals would be without it."""

from collections.abc import Sequence

import numpy as np

from ..fit.normal_equations import accumulate, ranges, slopes_of, stable
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel


def longer_without(problem: EstimationProblem, found: FittedModel, left_out: Sequence[Sequence[str]]) -> np.ndarray:
    """Intervals of the fitted numbers without some signals over those with all [sets, k]: by the information of the
    train windows about the fit, the initial states following, numbers held by their ranges."""
    fit, windows = found.fit, problem.train
    slopes = [stable(whole) for whole in slopes_of(found.model, windows, fit.x0, fit.p, fit.free, fit.x)]
    errors = [np.zeros_like(group.weight) for group in windows.groups]
    held = np.diag(ranges(fit.free)[2] ** -2.0)

    def deviations(without: Sequence[str]) -> np.ndarray:
        kept = np.array([name not in without for name in windows.names], float)
        own = [whole * np.tile(kept, whole.shape[1] // kept.size)[:, None] for whole in slopes]
        information = accumulate(found.model, windows, own, errors, fit.x0, fit.x0).reduced()[0].sum(axis=0)
        return np.sqrt(np.diag(np.linalg.inv(information + held)))

    return np.array([deviations(names) for names in left_out]) / deviations(())
