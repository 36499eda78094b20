"""Which equation lacks something: the windows with the largest errors, cut open, and what signals say directly."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..fit.windows import Windows
from .localise import LinearTimeVaryingModel, equation_of, linearise_windows, localise, parity_residuals
from .refit import EstimationProblem, FittedModel

_WINDOWS = 8  # with the largest errors, in which the equation is sought


@dataclass(frozen=True)
class FaultLocation:
    """Where a residual sits, with the evidence of each equation and the chi2 of those that signals test directly."""

    equation: str
    evidence: tuple[tuple[str, float], ...]
    parity_residuals: Mapping[str, float]


def locate_fault(problem: EstimationProblem, model_fit: FittedModel) -> FaultLocation:
    """The equation that lacks something, from the windows with the largest errors."""
    parts = worst(problem, model_fit)
    evidence = tuple(
        (item.equation, item.gain)
        for item in localise(opened(problem, model_fit, parts), problem.train.records[0].period)
    )
    parity = parity_residuals(model_fit.model, parts, model_fit.fit.p)
    return FaultLocation(equation_of(evidence, parity), evidence, parity)


def worst(problem: EstimationProblem, model_fit: FittedModel) -> list[tuple[Windows, np.ndarray]]:
    """The windows with the largest errors, fitted and held out, with their initial states."""
    squares = np.append(model_fit.fit.squares, model_fit.heldout)
    keep = np.sort(np.argsort(-squares)[:_WINDOWS])
    split = problem.train.count
    both = (
        (problem.train, model_fit.fit.x0, keep[keep < split]),
        (problem.heldout, model_fit.x0, keep[keep >= split] - split),
    )
    return [(windows.some(own.tolist()), x0[own]) for windows, x0, own in both if own.size]


def opened(
    problem: EstimationProblem, model_fit: FittedModel, parts: Sequence[tuple[Windows, np.ndarray]]
) -> dict[str, list[LinearTimeVaryingModel]]:
    """Windows cut open equation by equation, group after group."""
    linearised = [
        linearise_windows(problem.rig, model_fit.effects, w, x0, model_fit.fit.p, model_fit.model.plant)
        for w, x0 in parts
    ]
    return {
        equation: [group_model for part in linearised for group_model in part[equation]] for equation in linearised[0]
    }
