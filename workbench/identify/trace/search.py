"""The search of a trace: fit, gate, localise, then pass after pass until nothing is missing or nothing passes."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...base.checkpoint import OutOfTime
from ...plant.effects.declared import effects_alike
from ..fit.free_parameters import Candidate, at_strength
from . import rule as decide
from .batches import search_batches
from .context import TraceContext
from .findings import CandidateFit, Pass, partial_effect
from .joint import refit_pairs, without_false_first
from .localise import clear_evidence, likely_equations
from .locate import FaultLocation
from .problem import EstimationProblem
from .refit import FittedModel, fit_rig, refit, refit_without_last_effect
from .refits import FITS, from_declared, judge, run_pass
from .several import best_of_several
from .told import ToldEffects

_PASSES = 6  # effects at most


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What train and select records say: the rig alone as fitted, effects in the order in which they were added, the
    equation that lacks something (None at the floor), all passes, whether the time sufficed for what was to be tried,
    and, of a closed loop that misses something, which effects its records tell."""

    base: FittedModel
    effects: tuple[CandidateFit, ...]
    place: FaultLocation | None
    passes: tuple[Pass, ...]
    finished: bool = True
    told: ToldEffects | None = None


def search_effects(context: TraceContext) -> SearchResult:
    """The effects that the rig lacks, by train and select records alone."""
    search = _Search(context)
    return replace(search.run(), told=search.told)


class _Search:
    def __init__(self, context: TraceContext) -> None:
        self._whole, self._context = context, context.timed
        self._passes: list[Pass] = []
        self._finished = True
        self._likely: tuple[str, ...] = ()
        self.told: ToldEffects | None = None

    def run(self) -> SearchResult:
        """The whole search."""
        context = self._context
        context.steps.begin("fit of the rig alone", FITS, ahead=1)
        base = context.fit("base", lambda: fit_rig(context.problem, follows=False))
        context.steps.done()
        while True:
            context.report_progress(f"rig alone: chi2 {base.chi2:.4g} on what it did not see")
            if not context.is_misfit(base):
                return SearchResult(base, (), None, tuple(self._passes))
            if context.problem.rig.inner and self.told is None:
                context.report_progress("which effects the records of a closed loop show")
                self.told = self._whole.told(base)
            name = f"localise-{len(self._passes)}" if self._passes else "localise"
            place = self._whole.location(name, base, ahead=3)
            self._likely = _likely(place, context.problem)
            if context.by_batches:
                effects, passes, finished = search_batches(self._whole, base)
                return SearchResult(base, effects, place, passes, finished)
            effects, better = self._effects(base)
            if better is None:
                return SearchResult(base, effects, place, tuple(self._passes), self._finished)
            base = better

    def _effects(self, base: FittedModel) -> tuple[tuple[CandidateFit, ...], FittedModel | None]:
        """Effects one after the other, until nothing is missing or nothing passes, or time is over.

        Where the first pass shows that the rig alone can do better than `base`, nothing but that fit, which is last.
        """
        context = self._context
        effects: tuple[CandidateFit, ...] = ()
        model_fit = base
        with self._in_time():
            while len(effects) < _PASSES and context.is_misfit(model_fit):
                this_pass = self._pass(
                    model_fit, model_fit, equations=() if effects or context.several else self._likely
                )
                if (better := self._without_last_effect(model_fit, this_pass)) is not model_fit:
                    if not effects:
                        return (), better
                    model_fit, effects = better, (*effects[:-1], replace(effects[-1], model_fit=better))
                elif this_pass.accepted and self._adds(base, effects, this_pass):
                    first = this_pass.accepted[0]
                    again = not effects and not context.several and context.is_misfit(first.refitted)
                    effects = (
                        *effects,
                        self._or_alike(self._from_declared(first, model_fit), base) if again else first,
                    )
                elif context.several and (part := best_of_several(context.problem, model_fit, this_pass.tried)):
                    effects = (*effects, self._from_declared(part, model_fit))
                elif not effects and (pair := self._pair(this_pass, base)):
                    effects = pair
                else:
                    break
                model_fit = effects[-1].model_fit or model_fit
        return effects, None

    def _pass(
        self,
        model_fit: FittedModel,
        before: FittedModel,
        share: float = decide.NAMED,
        equations: Collection[str] = (),
    ) -> Pass:
        self._passes.append(run_pass(self._context, len(self._passes) + 1, model_fit, before, share, equations))
        self._finished &= self._passes[-1].finished
        return self._passes[-1]

    @contextmanager
    def _in_time(self) -> Iterator[None]:
        """What the end of the time may cut short: what was found until then stays."""
        try:
            yield
        except OutOfTime:
            self._finished = False

    def _without_last_effect(self, model_fit: FittedModel, this_pass: Pass) -> FittedModel:
        """The fit that a pass began with, or a better one of the same effects, from the numbers of the best refit."""
        fits = [
            tried.model_fit
            for tried in this_pass.tried
            if tried.model_fit is not None and np.isfinite(tried.model_fit.squares)
        ]
        if not fits:
            return model_fit
        with self._in_time():
            refitted = self._context.fit(
                f"without-{len(self._passes)}",
                lambda: refit_without_last_effect(self._context.problem, model_fit, fits[0]),
            )
            return refitted if _matters_for_fit(model_fit, refitted) else model_fit
        return model_fit

    def _from_declared(self, part: CandidateFit, before: FittedModel) -> CandidateFit:
        """The effect with its fit from the rig's declared numbers, where that is better and there is time."""
        with self._in_time():
            name = f"again-{len(self._passes)}-{part.candidate.effect.name}"
            return from_declared(self._context, name, part, before, before)
        return part

    def _or_alike(self, first: CandidateFit, base: FittedModel) -> CandidateFit:
        """The first name, or an effect that is not sought since that one's family looks much like it, where it leaves
        no more than a neighbour that is excluded would have to: the names tie, for both may be there."""
        context, found = self._context, [first]
        left, name = 1 - first.judgement.explained, first.candidate.effect.name
        if not context.is_misfit(first.refitted):
            return first
        with self._in_time():
            for effect in effects_alike(context.problem.rig, first.judgement.kin, context.without):
                candidate = Candidate(effect, at_strength(effect, 1.0))
                model_fit = context.fit(f"alike-{effect.title}", partial(refit, context.problem, base, candidate))
                judged = judge(context, effect, base, base, model_fit)
                if judged.passes and left > (1 + decide.NEIGHBOUR) * (1 - judged.explained):
                    tied = tuple(dict.fromkeys((name, *first.tied)))
                    found.append(CandidateFit(candidate, first.score, judged, model_fit, tied=tied))
        return min(found, key=lambda each: each.refitted.squares)

    def _adds(self, base: FittedModel, effects: tuple[CandidateFit, ...], this_pass: Pass) -> bool:
        """Whether the effect that a pass accepted goes to those before: it has to matter, but for a second one, which
        may be faint; a later one only if no name of another family explains as much."""
        if self._context.several:
            return True
        fall = this_pass.before.squares - this_pass.accepted[0].refitted.squares
        matters = decide.worth_adding(fall, base.squares, base.samples) or len(effects) == 1
        return matters and (not effects or _is_one_family(this_pass.accepted))

    def _pair(self, this_pass: Pass, base: FittedModel) -> tuple[CandidateFit, ...]:
        """Two effects that explain together what neither does alone: the best partial one, and one beside it."""
        first = partial_effect(this_pass)
        second = self._pass(first.refitted, base, decide.PAIR) if first else None
        if first and second and _is_one_family(second.accepted):
            return without_false_first(self._context, this_pass.before, first, second.accepted[0])
        together = refit_pairs(self._context, this_pass, first)
        self._passes += together
        return tuple(fit for each in together for fit in each.accepted)


def _likely(place: FaultLocation, problem: EstimationProblem) -> tuple[str, ...]:
    """The equations of effects that may explain a misfit: those that its evidence does not put clearly behind, and with
    the drive the stages behind it that have no evidence of their own."""
    clear = clear_evidence(place.evidence, problem.kappa)
    likely = likely_equations(place.evidence, place.parity_residuals, clear)
    apart = {name for name, _ in place.evidence}
    return (*likely, *(name for name in ("pilot", "main") if "drive" in likely and name not in apart))


def _is_one_family(accepted: Sequence[CandidateFit]) -> bool:
    """Whether there is an effect that explains enough, and none of another family explains as much."""
    return len({fit.candidate.effect.kin for fit in accepted}) == 1


def _matters_for_fit(model_fit: FittedModel, refitted: FittedModel) -> bool:
    """Whether a fit without a further effect is better by more than the rule asks of an effect."""
    before, after = (float(model.fit.squares.sum()) for model in (model_fit, refitted))
    return decide.worth_adding(before - after, before, model_fit.fit.samples)
