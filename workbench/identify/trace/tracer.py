"""Trace a residual to the effect that the model lacks: fit, gate, localise, shortlist, refit, decide, and again.

Every step is a stage that a resumed trace reads back. The rule is in rule.py: a wrong name is worse than "unknown".
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage
from ...base.errors import InputError
from ...plant.effects import Effect, applies
from ..fit.free_parameters import Candidate
from . import rule as decide
from .findings import CandidateFit, LearnedShape, Pass, Trace
from .locate import FaultLocation, locate_fault
from .problem import EstimationProblem
from .refit import (
    FittedModel,
    HeldoutErrors,
    fit_rig,
    heldout_errors,
    is_switched_off,
    refit,
    refit_all_windows,
    refit_from_declared,
    refit_without_last_effect,
)
from .several import best_of_several
from .shapes import ROUNDS, Shapes
from .shortlist import Shortlist, score_effects, unpacked_shortlist
from .stored import packed, unpacked

NAMES = 4  # effects on the shortlist
_FAINT = 0.02  # of the misfit: a score below this is not refitted, unless it is the best
_RIVAL = 0.25  # of the best score: below this no rival is refitted once the misfit is explained
_FORMULAS = 0.3  # of the explained share of its best formula: what a name must have for the others to be tried
_PASSES = 6  # effects at most


def trace(
    problem: EstimationProblem,
    library: Sequence[Effect],
    stage: Stage,
    report_progress: Progress,
    several: bool = False,
) -> Trace:
    """Trace the residual of a campaign to effects of `library` (those that the rig has room for).

    `several`: the rig is known to lack more than one; effects that explain only part of what is left are added too,
    the best first, until none passes. The verdict is then "incomplete" unless the residual reaches the floor.
    Held-out records are looked at when all is decided: they confirm what was found, or nothing is named.
    """
    return _Tracer(
        problem, [effect for effect in library if applies(effect, problem.rig)], stage, report_progress, several
    ).run()


class _Tracer:
    def __init__(
        self,
        problem: EstimationProblem,
        library: Sequence[Effect],
        stage: Stage,
        report_progress: Progress,
        several: bool,
    ) -> None:
        self._whole = self._problem = problem
        if problem.free_run:
            self._problem = problem.in_blocks()
        elif problem.large:
            self._problem = problem.only(stage("windows", problem.chosen))
        self._library, self._stage, self._report_progress, self._several = library, stage, report_progress, several
        self._passes: list[Pass] = []

    def run(self) -> Trace:
        """The whole trace."""
        base = self._stored("base", lambda: fit_rig(self._problem))
        while True:
            self._report_progress(f"rig alone: chi2 {base.chi2:.4g} on what it did not see")
            if not self._misfit(base):
                return self._result(base, (), (), None)
            place = self._located("localise", base)
            if place.evidence[0][1] < decide.SIGNIFICANT * self._problem.kappa:
                return self._result(base, (), (), place)
            effects, tied, better = self._search(base)
            if better is None:
                return self._result(base, effects, tied, place)
            base = better

    def _search(self, base: FittedModel) -> tuple[tuple[CandidateFit, ...], tuple[str, ...], FittedModel | None]:
        """Effects one after the other, until nothing is missing or nothing passes; the names that tie with the first.

        Where the first pass shows that the rig alone can do better than `base`, nothing but that fit, which is last.
        """
        effects: tuple[CandidateFit, ...] = ()
        tied: tuple[str, ...] = ()
        model_fit = base
        while (
            len(effects) < _PASSES
            and self._misfit(model_fit)
            and self._matters(base, model_fit.squares - model_fit.samples)
        ):
            this_pass = self._pass(model_fit, model_fit)
            if (better := self._without_last_effect(model_fit, this_pass)) is not model_fit:
                if not effects:
                    return (), (), better
                model_fit, effects = better, (*effects[:-1], replace(effects[-1], model_fit=better))
            elif this_pass.accepted and self._matters(base, model_fit.squares - this_pass.accepted[0].refitted.squares):
                tied = tied or tuple(other.candidate.effect.name for other in this_pass.accepted[1:])
                effects = (*effects, this_pass.accepted[0])
            elif self._several and (part := best_of_several(self._problem, model_fit, this_pass.tried)):
                effects = (*effects, self._refit_from_declared(part))
            elif not effects and (pair := self._pair(this_pass, base)):
                effects = pair
            else:
                break
            model_fit = effects[-1].model_fit or model_fit
        return effects, tied, None

    def _without_last_effect(self, model_fit: FittedModel, this_pass: Pass) -> FittedModel:
        """The fit that a pass began with, or a better one of the same effects, from the numbers of the best refit."""
        fits = [
            tried.model_fit
            for tried in this_pass.tried
            if tried.model_fit is not None and np.isfinite(tried.model_fit.squares)
        ]
        if not fits:
            return model_fit
        refitted = self._stored(
            f"without-{len(self._passes)}", lambda: refit_without_last_effect(self._problem, model_fit, fits[0])
        )
        return refitted if self._matters_for_fit(model_fit, refitted) else model_fit

    def _matters_for_fit(self, model_fit: FittedModel, refitted: FittedModel) -> bool:
        """Whether a fit without a further effect is better by more than the rule asks of an effect."""
        before, after = (float(model.fit.squares.sum()) for model in (model_fit, refitted))
        return decide.worth_adding(before - after, before, model_fit.fit.samples)

    def _refit_from_declared(self, candidate_fit: CandidateFit) -> CandidateFit:
        """The effect with its fit from the rig's declared numbers, where that is better."""
        name = f"again-{len(self._passes)}-{candidate_fit.candidate.effect.name}"
        return replace(
            candidate_fit,
            model_fit=self._stored(name, lambda: refit_from_declared(self._problem, candidate_fit.refitted)),
        )

    def _matters(self, base: FittedModel, fall: float) -> bool:
        return self._several or decide.worth_adding(fall, base.squares, base.samples)

    def _part(self, this_pass: Pass, share: float) -> CandidateFit | None:
        """The effect that explains most of what is left, if it passes and explains that share."""
        able = [tried for tried in this_pass.tried if tried.judgement.passes and tried.judgement.explained >= share]
        return able[0] if able else None

    def _pair(self, this_pass: Pass, base: FittedModel) -> tuple[CandidateFit, ...]:
        """Two effects that explain together what neither does alone: the best partial one, and one beside it."""
        first = self._part(this_pass, decide.PARTIAL)
        if first is None or first.model_fit is None:
            return ()
        second = self._pass(first.model_fit, base, decide.PAIR)
        return (first, second.accepted[0]) if second.accepted else ()

    def _pass(self, model_fit: FittedModel, before: FittedModel, share: float = decide.NAMED) -> Pass:
        """Shortlist, refit and judge against the misfit `before`; an effect that explains `share` of it is found."""
        number = len(self._passes) + 1
        names = [effect.name for effect in model_fit.effects]
        library = [effect for effect in self._library if effect.name not in names]
        shortlist = self._shortlist(number, model_fit, library)
        tried = self._refits(number, model_fit, before, shortlist.ranked)
        best = decide.named([candidate_fit.judgement for candidate_fit in tried], share)
        accepted = tuple(next(fit for fit in tried if fit.judgement is judgement) for judgement in best)
        self._passes.append(Pass(model_fit, shortlist.ranked, shortlist.compared, shortlist.cosines, tried, accepted))
        return self._passes[-1]

    def _shortlist(self, number: int, model_fit: FittedModel, library: Sequence[Effect]) -> Shortlist:
        def compute() -> dict[str, Any]:
            def report(effect: Effect) -> None:
                self._report_progress(f"pass {number}: score of {effect.name} {effect.formula}")

            return score_effects(self._problem, model_fit, library, report)

        return unpacked_shortlist(self._stage(f"scores-{number}", compute), library)

    def _refits(
        self, number: int, model_fit: FittedModel, base: FittedModel, ranked: Sequence[tuple[Candidate, float]]
    ) -> tuple[CandidateFit, ...]:
        """Refits of the shortlist, most explained first: the best formula of each name, then its others."""
        able = [pair for place, pair in enumerate(ranked) if place == 0 or pair[1] > _FAINT]
        names = list(dict.fromkeys(candidate.effect.name for candidate, _ in able))[:NAMES]
        tried: list[CandidateFit] = []
        for name in names:
            own = [pair for pair in able if pair[0].effect.name == name]
            explained = max((candidate_fit.judgement.explained for candidate_fit in tried), default=0.0)
            if explained >= decide.NAMED and own[0][1] < _RIVAL * ranked[0][1]:
                continue
            first = self._try(number, model_fit, base, *own[0], again=not tried)
            tried.append(first)
            if not self._several and first.judgement.explained >= _FORMULAS * max(explained, decide.PARTIAL):
                tried += [self._try(number, model_fit, base, *pair) for pair in own[1:]]
        if self._several and (best := best_of_several(self._problem, model_fit, tried)):
            name = best.judgement.name
            own = [pair for pair in ranked if pair[0].effect.name == name]
            tried += [self._try(number, model_fit, base, *pair) for pair in own[1:]]
        return tuple(sorted(tried, key=lambda candidate_fit: -candidate_fit.judgement.explained))

    def _try(
        self,
        number: int,
        model_fit: FittedModel,
        base: FittedModel,
        candidate: Candidate,
        share: float,
        again: bool = False,
    ) -> CandidateFit:
        effect, n = candidate.effect, model_fit.samples
        self._report_progress(f"pass {number}: fit with {effect.title}")
        try:
            refitted = self._stored(
                f"refit-{number}-{effect.name}-{effect.formula}",
                lambda: refit(self._problem, model_fit, candidate, again),
            )
        except (InputError, np.linalg.LinAlgError, RuntimeError) as error:
            nothing = decide.Judgement(effect.name, effect.formula, 0.0, np.inf, len(effect.fitted), False)
            return CandidateFit(candidate, share, nothing, None, str(error))
        explained = decide.explained(base.squares, refitted.squares, n)
        self._report_progress(f"pass {number}: {effect.name} {effect.formula} explains {100 * explained:.1f} %")
        squares = float(model_fit.fit.squares.sum()), float(refitted.fit.squares.sum())
        fall = decide.bic_fall(*squares, len(effect.fitted), self._problem.train.samples)
        passes = decide.passes(model_fit.squares, refitted.squares, fall, self._problem.kappa, len(self._library))
        passes = passes and not is_switched_off(refitted)
        judgement = decide.Judgement(
            effect.name, effect.formula, explained, refitted.squares / n, len(effect.fitted), passes
        )
        return CandidateFit(candidate, share, judgement, refitted)

    def _located(self, name: str, base: FittedModel, heldout: HeldoutErrors | None = None) -> FaultLocation:
        def compute() -> dict[str, Any]:
            self._report_progress("in which equation")
            location = locate_fault(self._whole if heldout else self._problem, base, heldout)
            evidence = [list(gain) for gain in location.evidence]  # a stage keeps no tuples
            return asdict(location) | {"evidence": evidence}

        stored = self._stage(f"{name}-{len(self._passes)}" if self._passes else name, compute)
        return FaultLocation(
            stored["equation"], tuple((name, gain) for name, gain in stored["evidence"]), stored["parity_residuals"]
        )

    def _again(self, name: str, model_fit: FittedModel) -> FittedModel:
        """A fit of thinned windows refitted to all of them; where none were left out it stays."""
        if self._whole is self._problem:
            return model_fit
        stored = self._stage(name, lambda: packed(refit_all_windows(self._whole, model_fit)))
        return unpacked(stored, self._whole, self._library)

    def _misfit(self, model_fit: FittedModel) -> bool:
        return decide.misfit(model_fit.chi2, model_fit.samples, self._problem.kappa)

    def _stored(self, name: str, compute: Callable[[], FittedModel]) -> FittedModel:
        return unpacked(self._stage(name, lambda: packed(compute())), self._problem, self._library)

    def _result(
        self,
        base: FittedModel,
        effects: tuple[CandidateFit, ...],
        tied: tuple[str, ...],
        place: FaultLocation | None,
    ) -> Trace:
        """What held-out records make of the search, which ends before they are looked at."""
        alone = self._again("base, all windows", base)
        named = self._again("final", effects[-1].refitted) if effects else alone
        before = self._heldout("before", alone)
        if not np.isfinite(before.chi2):
            raise InputError(
                f"{self._problem.campaign.path}: {self._problem.rig.name} cannot follow the held-out records; "
                "check them"
            )
        plain = self._heldout("named", named) if effects else before
        refuted: tuple[CandidateFit, ...] = ()
        if effects and not (self._several or self._confirmed(before, plain)):
            effects, tied, refuted, named, plain = (), (), effects, alone, before
        if place is None and decide.misfit(before.chi2, before.samples, self._problem.kappa):
            place = self._located("localise held-out", alone, before)
        verdict = self._verdict(plain, effects, tied, place)
        final, after, learned = named, plain, ()
        if verdict in ("unknown", "incomplete"):
            search = effects[-1].refitted if effects else self._nearest(base)
            final, after, learned = self._shaped(search, named, plain)
        equation = effects[0].candidate.effect.equation if effects else place.equation if place else None
        return Trace(
            problem=self._whole,
            base=alone,
            named=named,
            final=final,
            heldout=(before, plain, after),
            verdict=verdict,
            effects=effects,
            tied=tied,
            equation=None if verdict == "none" else equation,
            evidence=place.evidence if place else (),
            parity_residuals=place.parity_residuals if place else {},
            passes=tuple(self._passes),
            refuted=refuted,
            learned=learned,
        )

    def _nearest(self, base: FittedModel) -> FittedModel:
        """What an unknown's shape is sought from: the effect that passes and explains most of it, or the rig alone."""
        part = self._part(self._passes[0], decide.PARTIAL) if self._passes else None
        return part.refitted if part else base

    def _shaped(
        self, search: FittedModel, named: FittedModel, plain: HeldoutErrors
    ) -> tuple[FittedModel, HeldoutErrors, tuple[LearnedShape, ...]]:
        """The fit with what can be learned of the rig's shape, if the held-out records bear it out; else as named."""
        shapes = Shapes(self._problem, self._library, self._stage, self._report_progress)
        found: list[tuple[Effect, FittedModel]] = []
        for number in range(1, ROUNDS + 1):
            if not self._misfit(search) or (shape := shapes.best(number, search)) is None:
                break
            found.append(shape)
            search = shape[1]
        if not found:
            return named, plain, ()
        fits = [self._again(f"shape {number}, all windows", fit) for number, (_, fit) in enumerate(found, 1)]
        errors = [self._heldout(f"shape {number}", fit) for number, fit in enumerate(fits, 1)]
        if not errors[-1].chi2 < plain.chi2:
            return named, plain, ()
        learned = tuple(
            LearnedShape(effect, effect.formula.split("; ")[-1], each.chi2)
            for (effect, _), each in zip(found, errors, strict=True)
        )
        return fits[-1], errors[-1], learned

    def _verdict(
        self,
        after: HeldoutErrors,
        effects: tuple[CandidateFit, ...],
        tied: tuple[str, ...],
        place: FaultLocation | None,
    ) -> str:
        if not effects:
            missing = place is not None and place.evidence[0][1] >= decide.SIGNIFICANT * self._problem.kappa
            return "unknown" if missing else "none"
        if decide.misfit(after.chi2, after.samples, self._problem.kappa):
            return "incomplete"
        return "tied" if tied and len(effects) == 1 else "named"

    def _confirmed(self, before: HeldoutErrors, after: HeldoutErrors) -> bool:
        squares = float(before.squares.sum()), float(after.squares.sum())
        return decide.confirmed(*squares, after.samples, self._problem.kappa)

    def _heldout(self, name: str, model_fit: FittedModel) -> HeldoutErrors:
        return HeldoutErrors(**self._stage(f"heldout {name}", lambda: asdict(heldout_errors(self._whole, model_fit))))
