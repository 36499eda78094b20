"""One pass of a search: effects are scored about a fit, the best are refitted beside it, and the rule judges them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate
from . import rule as decide
from .context import TraceContext
from .findings import CandidateFit, Pass
from .refit import FittedModel, is_switched_off, refit
from .several import best_of_several
from .shortlist import Shortlist, score_effects, unpacked_shortlist

NAMES = 4  # effects on the shortlist
_FAINT = 0.02  # of the misfit: a score below this is not refitted, unless it is the best
_RIVAL = 0.25  # of the best score: below this no rival is refitted once the misfit is explained
_FORMULAS = 0.3  # of the explained share of its best formula: what a name must have for the others to be tried

_LOST = 0.05  # explained share below which a formula with memory says nothing of the name's other ones


def run_pass(
    context: TraceContext, number: int, model_fit: FittedModel, before: FittedModel, share: float = decide.NAMED
) -> Pass:
    """Shortlist, refit and judge against the misfit of `before`; an effect that explains `share` of it is accepted."""
    names = [effect.name for effect in model_fit.effects]
    library = [effect for effect in context.library if effect.name not in names]
    shortlist = _shortlist(context, number, model_fit, library)
    tried = _Refits(context, number, model_fit, before).of(shortlist.ranked)
    best = decide.named([candidate_fit.judgement for candidate_fit in tried], share)
    accepted = tuple(next(fit for fit in tried if fit.judgement is judgement) for judgement in best)
    return Pass(model_fit, shortlist.ranked, shortlist.compared, shortlist.cosines, tried, accepted)


def _shortlist(context: TraceContext, number: int, model_fit: FittedModel, library: Sequence[Effect]) -> Shortlist:
    def compute() -> dict[str, Any]:
        def report(effect: Effect) -> None:
            context.report_progress(f"pass {number}: score of {effect.name} {effect.formula}")

        return score_effects(context.problem, model_fit, library, report)

    return unpacked_shortlist(context.stage(f"scores-{number}", compute), library)


class _Refits:
    """The refits of a pass beside `model_fit`, judged against the misfit of `before`."""

    def __init__(self, context: TraceContext, number: int, model_fit: FittedModel, before: FittedModel) -> None:
        self._context, self._number, self._model_fit, self._before = context, number, model_fit, before

    def of(self, ranked: Sequence[tuple[Candidate, float]]) -> tuple[CandidateFit, ...]:
        """Refits of the shortlist, most explained first: the best formula of each name, then its others."""
        several = self._context.several
        able = [pair for place, pair in enumerate(ranked) if place == 0 or pair[1] > _FAINT]
        names = list(dict.fromkeys(candidate.effect.name for candidate, _ in able))[:NAMES]
        tried: list[CandidateFit] = []
        for name in names:
            own = [pair for pair in able if pair[0].effect.name == name]
            explained = max((candidate_fit.judgement.explained for candidate_fit in tried), default=0.0)
            if explained >= decide.NAMED and own[0][1] < _RIVAL * ranked[0][1]:
                continue
            first = self._try(*own[0], again=not tried)
            tried.append(first)
            if not several and first.judgement.explained >= _FORMULAS * max(explained, decide.PARTIAL):
                tried += [self._try(*pair) for pair in own[1:]]
            elif not several and _is_lost(first):
                tried += self._others_with_memory(first.judgement, ranked)
        if several and (best := best_of_several(self._context.problem, self._model_fit, tried)):
            name = best.judgement.name
            own = [pair for pair in ranked if pair[0].effect.name == name]
            tried += [self._try(*pair) for pair in own[1:]]
        return tuple(sorted(tried, key=lambda candidate_fit: -candidate_fit.judgement.explained))

    def _others_with_memory(
        self, first: decide.Judgement, ranked: Sequence[tuple[Candidate, float]]
    ) -> list[CandidateFit]:
        """The name's other formulas with memory, whatever their score, until one explains the misfit."""
        tried: list[CandidateFit] = []
        for candidate, share in ranked:
            effect = candidate.effect
            if effect.name == first.name and effect.formula != first.formula and effect.has_memory:
                tried.append(self._try(candidate, share))
                if tried[-1].judgement.explained >= decide.NAMED:
                    break
        return tried

    def _try(self, candidate: Candidate, share: float, again: bool = False) -> CandidateFit:
        context, number, effect = self._context, self._number, candidate.effect
        context.report_progress(f"pass {number}: fit with {effect.title}")
        try:
            refitted = context.fit(
                f"refit-{number}-{effect.name}-{effect.formula}",
                lambda: refit(context.problem, self._model_fit, candidate, again),
            )
        except (InputError, np.linalg.LinAlgError, RuntimeError) as error:
            nothing = decide.Judgement(effect.name, effect.formula, 0.0, np.inf, len(effect.fitted), False)
            return CandidateFit(candidate, share, nothing, None, str(error))
        judgement = self._judged(effect, refitted)
        explained = 100 * judgement.explained
        context.report_progress(f"pass {number}: {effect.name} {effect.formula} explains {explained:.1f} %")
        return CandidateFit(candidate, share, judgement, refitted)

    def _judged(self, effect: Effect, refitted: FittedModel) -> decide.Judgement:
        context, model_fit, n = self._context, self._model_fit, self._model_fit.samples
        explained = decide.explained(self._before.squares, refitted.squares, n)
        squares = float(model_fit.fit.squares.sum()), float(refitted.fit.squares.sum())
        fall = decide.bic_fall(*squares, len(effect.fitted), context.problem.train.samples)
        kappa = context.problem.kappa
        passes = decide.passes(model_fit.squares, refitted.squares, fall, kappa, len(context.library))
        passes = passes and not is_switched_off(refitted)
        return decide.Judgement(
            effect.name, effect.formula, explained, refitted.squares / n, len(effect.fitted), passes
        )


def _is_lost(first: CandidateFit) -> bool:
    """Whether a formula with memory explains nothing: a score at windows in which a loop hunts says little of it."""
    return first.candidate.effect.has_memory and first.judgement.explained < _LOST
