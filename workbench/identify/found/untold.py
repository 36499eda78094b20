"""Numbers that the records of a closed loop do not tell stay as they were; the others are fitted beside them."""

from dataclasses import replace

import numpy as np

from ...plant.effects import numbers_of
from ..fit.normal_equations import numbers_at
from ..fit.solver import Fit, fit_numbers
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel


def without_untold(problem: EstimationProblem, found: FittedModel) -> tuple[Fit, tuple[str, ...]]:
    """The fit of a rig with an inner loop, the numbers that its records do not tell back where they were declared, and
    their names; of other rigs the fit as it is, since their ranges are those of a datasheet.

    The least told is held first: of two that are told together the other is told then. One that the records tell to be
    another one, though not which, is not held. Intervals stay those of the fit in which all were free.
    """
    fit, held = found.fit, list[str]()
    while problem.rig.inner is not None and (name := _least_told(problem, fit)):
        before = numbers_at(found.model, fit.free, np.where([f.name == name for f in fit.free], 0.0, fit.x), fit.p)
        rest = [k for k, free in enumerate(fit.free) if free.name != name]
        free, x = [fit.free[k] for k in rest], fit.x[rest]
        fit = fit_numbers(found.model, problem.train, free, x, before, fit.x0, problem.kappas, near=True)
        if not fit.ok:
            return found.fit, ()
        held.append(name)
    at = dict(zip([free.name for free in fit.free], fit.x.tolist(), strict=True))
    x = np.array([at.get(free.name, 0.0) for free in found.fit.free])
    return replace(found.fit, x=x, p=fit.p, x0=fit.x0, squares=fit.squares), tuple(held)


def _least_told(problem: EstimationProblem, fit: Fit) -> str:
    """The rig's number of which a fit says least, of those that may well be what they were; none is empty."""
    deviations, names = np.sqrt(np.diag(fit.covariance)), numbers_of(problem.rig)
    open_ones = {
        free.name: deviations[k] / free.width
        for k, free in enumerate(fit.free)
        if free.name in names and fit.leaves_open(k) and abs(fit.x[k]) < 1.96 * deviations[k]
    }
    return max(open_ones, key=lambda name: open_ones[name], default="")
