"""The shortlist of a pass: every effect's score about a fit, and the cosines between the best of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.checkpoint import no_checkpoint
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate
from .problem import EstimationProblem
from .refit import FittedModel
from .score import NuisanceProjection, Score, cosines, score, worst_windows
from .stored import packed_candidate, unpacked_candidate
from .workers import Workers

_TOGETHER = 8  # effects that a worker scores at a time: each time it computes what the numbers could do as well


@dataclass(frozen=True, eq=False)
class Shortlist:
    """Every candidate with its share of the misfit, most first; names [k] and cosines [k, k] of the best formula of
    each effect whose score is positive."""

    ranked: tuple[tuple[Candidate, float], ...]
    compared: tuple[str, ...]
    cosines: np.ndarray


def score_effects(
    workers: Workers,
    problem: EstimationProblem,
    model_fit: FittedModel,
    library: Sequence[Effect],
    report: Callable[[Sequence[str]], None],
) -> dict[str, Any]:
    """Scores of all effects in the windows where a fit is most wrong, as a stage of a run keeps them.

    `report` hears the names of those that have been scored.
    """
    titles = [effect.title for effect in library]
    parts = {str(first): titles[first : first + _TOGETHER] for first in range(0, len(titles), _TOGETHER)}
    results = workers(_score_part, model_fit, parts, no_checkpoint, lambda part: report(part["names"]))
    scores = [
        Score(unpacked_candidate(candidate, library), gain, shape)
        for part in results
        for candidate, gain, shape in zip(part["candidates"], part["gains"], part["shapes"], strict=True)
    ]
    scores.sort(key=lambda entry: -entry.gain)
    windows, fit = worst_windows(problem.train, model_fit.fit)
    misfit = max(float(fit.squares.sum()) - windows.samples, 1.0)
    first = [entry for place, entry in enumerate(scores) if entry.gain > 0 and _is_best_formula(scores, place)]
    return {
        "scores": [packed_candidate(entry.candidate) | {"share": entry.gain / misfit} for entry in scores],
        "names": [entry.candidate.effect.name for entry in first],
        "cosines": cosines(first) if first else np.zeros((0, 0)),
    }


def _score_part(
    problem: EstimationProblem, library: Sequence[Effect], model_fit: FittedModel, titles: Sequence[str]
) -> dict[str, Any]:
    """Scores of the effects with these titles."""
    windows, fit = worst_windows(problem.train, model_fit.fit)
    rest = NuisanceProjection(model_fit.model, windows, fit)
    effects = [effect for effect in library if effect.title in titles]
    scores = [score(problem.rig, model_fit.effects, effect, model_fit.model, windows, fit, rest) for effect in effects]
    return {
        "names": list(dict.fromkeys(effect.name for effect in effects)),
        "candidates": [packed_candidate(entry.candidate) for entry in scores],
        "gains": [entry.gain for entry in scores],
        "shapes": [entry.shape for entry in scores],
    }


def unpacked_shortlist(stored: Mapping[str, Any], library: Sequence[Effect]) -> Shortlist:
    """The shortlist that `score_effects` computed. Raises InputError where the library lacks an effect of it."""
    ranked = tuple((unpacked_candidate(entry, library), float(entry["share"])) for entry in stored["scores"])
    return Shortlist(ranked, tuple(stored["names"]), np.asarray(stored["cosines"]))


def _is_best_formula(scores: Sequence[Score], place: int) -> bool:
    name = scores[place].candidate.effect.name
    return name not in [entry.candidate.effect.name for entry in scores[:place]]
