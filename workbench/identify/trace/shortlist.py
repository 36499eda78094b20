"""The shortlist of a pass: every effect's score about a fit, and the cosines between the best of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.checkpoint import no_checkpoint
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate
from .pairs import best_pairs
from .problem import EstimationProblem
from .refit import FittedModel
from .score import NuisanceProjection, Score, cosines, packed_trial, score, unpacked_trial, worst_windows
from .stored import packed_candidate, unpacked_candidate
from .workers import Workers

_TOGETHER = 20  # effects that a worker scores at a time: each time it computes what the numbers could do as well

_PAIRS = 3


@dataclass(frozen=True, eq=False)
class Shortlist:
    """Every candidate with its share of the misfit, most first; names [k] and cosines [k, k] of the best formula of
    each effect whose score is positive; pairs that explain more than one effect, most first, with their shares."""

    ranked: tuple[tuple[Candidate, float], ...]
    compared: tuple[str, ...]
    cosines: np.ndarray
    pairs: tuple[tuple[tuple[Candidate, Candidate], float], ...]


def score_effects(
    workers: Workers,
    problem: EstimationProblem,
    model_fit: FittedModel,
    library: Sequence[Effect],
    report: Callable[[Sequence[str]], None],
    rivals: bool = False,
) -> dict[str, Any]:
    """Scores of all effects in the windows where a fit is most wrong, as a stage of a run keeps them.

    `report` hears the name of each that has been scored. `rivals`: of a number that a fit cannot move any further,
    so that numbers at an end of their range make up for none of them.
    """
    titles = [effect.title for effect in library]
    parts = {
        str(first): {"titles": titles[first : first + _TOGETHER], "rivals": rivals}
        for first in range(0, len(titles), _TOGETHER)
    }
    results = workers(_score_part, model_fit, parts, no_checkpoint, lambda part: report(part["names"]))
    scores = [
        _unpacked_score(unpacked_candidate(candidate, library), gain, shape, trials)
        for part in results
        for candidate, gain, shape, trials in zip(
            part["candidates"], part["gains"], part["shapes"], part["trials"], strict=True
        )
    ]
    scores.sort(key=lambda entry: -entry.gain)
    windows, fit = worst_windows(problem.train, model_fit.fit)
    misfit = max(float(fit.squares.sum()) - windows.samples, 1.0)
    first = [entry for place, entry in enumerate(scores) if entry.gain > 0 and _is_best_formula(scores, place)]
    return {
        "scores": [packed_candidate(entry.candidate) | {"share": entry.gain / misfit} for entry in scores],
        "names": [entry.candidate.effect.name for entry in first],
        "cosines": cosines(first) if first else np.zeros((0, 0)),
        "pairs": [
            {"candidates": [packed_candidate(candidate) for candidate in pair.candidates], "share": pair.gain / misfit}
            for pair in best_pairs([trial for entry in scores for trial in entry.trials], _PAIRS)
        ],
    }


def _score_part(
    problem: EstimationProblem, library: Sequence[Effect], model_fit: FittedModel, part: Mapping[str, Any]
) -> dict[str, Any]:
    """Scores of the effects with a part's titles."""
    windows, fit = worst_windows(problem.train, model_fit.fit)
    base = problem.model(model_fit.effects, coarse=True)
    rest = NuisanceProjection(base, windows, fit)
    rest = rest.without("") if part["rivals"] else rest
    effects = [effect for effect in library if effect.title in part["titles"]]
    scores = [score(problem.rig, model_fit.effects, effect, base, windows, fit, rest) for effect in effects]
    return {
        "names": [effect.name for effect in effects],
        "candidates": [packed_candidate(entry.candidate) for entry in scores],
        "gains": [entry.gain for entry in scores],
        "trials": [[packed_trial(trial) for trial in entry.trials] for entry in scores],
        "shapes": [entry.shape for entry in scores],
    }


def unpacked_shortlist(stored: Mapping[str, Any], library: Sequence[Effect]) -> Shortlist:
    """The shortlist that `score_effects` computed. Raises InputError where the library lacks an effect of it."""
    ranked = tuple((unpacked_candidate(entry, library), float(entry["share"])) for entry in stored["scores"])
    pairs = tuple((_unpacked_both(entry["candidates"], library), float(entry["share"])) for entry in stored["pairs"])
    return Shortlist(ranked, tuple(stored["names"]), np.asarray(stored["cosines"]), pairs)


def _unpacked_score(candidate: Candidate, gain: float, shape: np.ndarray, trials: Sequence[Mapping[str, Any]]) -> Score:
    return Score(candidate, gain, shape, tuple(unpacked_trial(trial, candidate.effect) for trial in trials))


def _unpacked_both(stored: Sequence[Mapping[str, Any]], library: Sequence[Effect]) -> tuple[Candidate, Candidate]:
    first, second = (unpacked_candidate(entry, library) for entry in stored)
    return first, second


def _is_best_formula(scores: Sequence[Score], place: int) -> bool:
    name = scores[place].candidate.effect.name
    return name not in [entry.candidate.effect.name for entry in scores[:place]]
