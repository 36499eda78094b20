"""The shortlist of a pass: every effect's score about a fit, and the cosines between the best of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...plant.effects import Effect
from ..fit.free_parameters import Candidate
from .problem import EstimationProblem
from .refit import FittedModel
from .score import NuisanceProjection, Score, cosines, score, worst_windows
from .stored import packed_candidate, unpacked_candidate


@dataclass(frozen=True, eq=False)
class Shortlist:
    """Every candidate with its share of the misfit, most first; names [k] and cosines [k, k] of the best formula of
    each effect whose score is positive."""

    ranked: tuple[tuple[Candidate, float], ...]
    compared: tuple[str, ...]
    cosines: np.ndarray


def score_effects(
    problem: EstimationProblem, model_fit: FittedModel, library: Sequence[Effect], report: Callable[[Effect], None]
) -> dict[str, Any]:
    """Scores of all effects in the windows where a fit is most wrong, as a stage of a run keeps them."""
    windows, fit = worst_windows(problem.train, model_fit.fit)
    rest = NuisanceProjection(model_fit.model, windows, fit)
    scores: list[Score] = []
    for effect in library:
        scores.append(score(problem.rig, model_fit.effects, effect, model_fit.model, windows, fit, rest))
        report(effect)
    scores.sort(key=lambda entry: -entry.gain)
    misfit = max(float(fit.squares.sum()) - windows.samples, 1.0)
    first = [entry for place, entry in enumerate(scores) if entry.gain > 0 and _is_best_formula(scores, place)]
    return {
        "scores": [packed_candidate(entry.candidate) | {"share": entry.gain / misfit} for entry in scores],
        "names": [entry.candidate.effect.name for entry in first],
        "cosines": cosines(first) if first else np.zeros((0, 0)),
    }


def unpacked_shortlist(stored: Mapping[str, Any], library: Sequence[Effect]) -> Shortlist:
    """The shortlist that `score_effects` computed. Raises InputError where the library lacks an effect of it."""
    ranked = tuple((unpacked_candidate(entry, library), float(entry["share"])) for entry in stored["scores"])
    return Shortlist(ranked, tuple(stored["names"]), np.asarray(stored["cosines"]))


def _is_best_formula(scores: Sequence[Score], place: int) -> bool:
    name = scores[place].candidate.effect.name
    return name not in [entry.candidate.effect.name for entry in scores[:place]]
