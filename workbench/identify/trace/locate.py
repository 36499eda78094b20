"""Which equation lacks something: the windows with the largest errors, cut open, and what signals say directly."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..fit.windows import Windows
from .cuts import cut_residuals
from .localise import LinearTimeVaryingModel, equation_of, linearise_windows, localise
from .problem import EstimationProblem
from .refit import FittedModel, HeldoutErrors

_WINDOWS = 8  # with the largest errors, in which the equation is sought


@dataclass(frozen=True)
class FaultLocation:
    """The equation that a residual sits in, each one's evidence, and the chi2 of those that signals test directly."""

    equation: str
    evidence: tuple[tuple[str, float], ...]
    parity_residuals: Mapping[str, float]


def locate_fault(
    problem: EstimationProblem, model_fit: FittedModel, heldout: HeldoutErrors | None = None
) -> FaultLocation:
    """The equation that lacks something, from the windows with the largest errors: see `worst`."""
    windows, x0 = worst(problem, model_fit, heldout)
    parts = opened(problem, model_fit, windows, x0)
    evidence = tuple((item.equation, item.gain) for item in localise(parts, problem.train.records[0].period))
    parity = cut_residuals(problem, model_fit, windows, x0)
    return FaultLocation(equation_of(evidence, parity), evidence, parity)


def worst(
    problem: EstimationProblem, model_fit: FittedModel, heldout: HeldoutErrors | None = None
) -> tuple[Windows, np.ndarray]:
    """The train windows with the largest errors and their initial states, or held-out ones where those are larger."""
    windows, x0, squares = problem.train, model_fit.fit.x0, model_fit.fit.squares
    if heldout is not None and heldout.chi2 > model_fit.fit.chi2:
        windows, x0, squares = problem.heldout, heldout.x0, heldout.squares
    keep = np.sort(np.argsort(-squares, kind="stable")[:_WINDOWS])
    return windows.some(keep.tolist()), x0[keep]


def opened(
    problem: EstimationProblem, model_fit: FittedModel, windows: Windows, x0: np.ndarray
) -> dict[str, list[LinearTimeVaryingModel]]:
    """Windows cut open equation by equation, group after group."""
    return linearise_windows(problem.rig, model_fit.effects, windows, x0, model_fit.fit.p, model_fit.model)
