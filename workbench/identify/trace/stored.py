"""Fits as what a stage of a run can keep, and back: arrays and names, no models."""

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...plant.effects import Effect, known_effects, refine_at
from ...plant.effects.grammar import LEARNED
from ...plant.effects.learned_pieces import find_learned
from ..fit.free_parameters import Candidate
from ..fit.rotation import Selection
from ..fit.solver import Fit
from .problem import EstimationProblem
from .refit import FittedModel

_ARRAYS = ("x", "p", "x0", "squares", "covariance", "matrices", "gradients", "unseen")


def packed(model_fit: FittedModel) -> dict[str, Any]:
    """A fit as dict, list, numbers and arrays."""
    fit = {name: getattr(model_fit.fit, name) for name in _ARRAYS}
    return {
        "known": [packed_candidate(candidate) for candidate in model_fit.known],
        "fit": fit | {"samples": model_fit.fit.samples, "at_bounds": list(model_fit.fit.at_bounds)},
        "selection": {"squares": model_fit.selection.squares, "samples": model_fit.selection.samples},
    }


def unpacked(stored: Mapping[str, Any], problem: EstimationProblem, library: Sequence[Effect]) -> FittedModel:
    """The fit again."""
    known = tuple(unpacked_candidate(item, library, problem.samples) for item in stored["known"])
    model = problem.model([candidate.effect for candidate in known])
    free = (*problem.free, *(number for candidate in known for number in candidate.free()))
    arrays = {name: stored["fit"][name] for name in _ARRAYS}
    fit = Fit(free=free, samples=stored["fit"]["samples"], at_bounds=tuple(stored["fit"]["at_bounds"]), **arrays)
    return FittedModel(known, model, fit, Selection(**stored["selection"]))


def packed_refit(refit: Callable[[], FittedModel]) -> dict[str, Any]:
    """A refit as `packed` keeps it, or why there is none."""
    try:
        return packed(refit())
    except (InputError, np.linalg.LinAlgError, RuntimeError) as error:
        return {"failed": str(error)}


def packed_candidate(candidate: Candidate) -> dict[str, Any]:
    """A candidate by name, formula and start."""
    return {"name": candidate.effect.name, "formula": candidate.effect.formula, "start": dict(candidate.start)}


def unpacked_candidate(
    stored: Mapping[str, Any], library: Sequence[Effect], samples: Mapping[str, np.ndarray] | None = None
) -> Candidate:
    """The candidate again, a refined or learned one by its words and the `samples` that it was placed on.

    Raises InputError where the library does not have it any more.
    """
    name, formula = stored["name"], stored["formula"]
    plain, *refinements = (words.strip() for words in formula.split(";"))
    for effect in (*library, *(known for known in known_effects() if known.alike)):
        if (effect.name, effect.formula) in ((name, formula), (name, plain)):
            words = refinements if effect.formula == plain else ()
            return Candidate(reduce(lambda e, said: refine_at(e, said, samples or {}), words, effect), stored["start"])
    if name.startswith(LEARNED):
        return Candidate(find_learned(name, formula, samples), stored["start"])
    raise InputError(f"{name} {formula} is not in the library any more; start the trace anew")
