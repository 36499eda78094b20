"""The search for a rig's own shape, tier by tier, with stages that a resumed trace reads back."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage
from ...base.errors import InputError
from ...plant.effects import Effect
from .locate import locate_fault
from .problem import EstimationProblem
from .refit import FittedModel
from .reshape import REFITS, Reshaping, best, offered, refit_reshaped, scored
from .stored import packed, packed_candidate, unpacked, unpacked_candidate

ROUNDS = 3  # reshapings that may follow one another


class Shapes:
    """Looks for the reshaping of a fit that the rule takes."""

    def __init__(
        self, problem: EstimationProblem, library: Sequence[Effect], stage: Stage, report_progress: Progress
    ) -> None:
        self._problem, self._library, self._stage, self._report_progress = problem, library, stage, report_progress

    def best(self, number: int, before: FittedModel) -> tuple[Effect, FittedModel] | None:
        """The effect as reshaped, or learned, and the fit with it: the first tier in which one passes; else None."""
        equation = self._stage(f"shapes-{number}", lambda: locate_fault(self._problem, before).equation)
        for tier, reshapings in enumerate(offered(self._problem, before, equation)):
            scores = self._scores(f"{number}-{tier}", before, reshapings)
            refits = [(each, self._refit(number, before, each)) for each, _ in scores[:REFITS]]
            able = [(each, fitted) for each, fitted in refits if fitted is not None]
            if taken := best(self._problem, before, able, max(len(scores), 1)):
                reshaping, fitted = taken
                return reshaping.candidate.effect, fitted
        return None

    def _scores(self, name: str, before: FittedModel, reshapings: Sequence[Reshaping]) -> list[tuple[Reshaping, float]]:
        def compute() -> list[dict[str, Any]]:
            self._report_progress(f"shape {name}: {len(reshapings)} reshapings, scored")
            scores = scored(self._problem, before, reshapings)
            return [packed_candidate(each.candidate) | {"place": each.place, "gain": gain} for each, gain in scores]

        return [
            (
                Reshaping(unpacked_candidate(entry, self._library, self._problem.samples), entry["place"]),
                float(entry["gain"]),
            )
            for entry in self._stage(f"scores-shape-{name}", compute)
        ]

    def _refit(self, number: int, before: FittedModel, reshaping: Reshaping) -> FittedModel | None:
        title = reshaping.candidate.effect.title
        self._report_progress(f"shape {number}: fit with {title}")
        try:
            stored = self._stage(
                f"shape-{number}-{title}", lambda: packed(refit_reshaped(self._problem, before, reshaping))
            )
        except (InputError, np.linalg.LinAlgError, RuntimeError):
            return None
        fitted = unpacked(stored, self._problem, self._library)
        self._report_progress(f"shape {number}: {title}: chi2 {fitted.chi2:.4g} on what it did not see")
        return fitted
