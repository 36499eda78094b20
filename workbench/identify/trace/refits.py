"""One pass of a search: effects are scored about a fit, the best are refitted beside it, and the rule judges them."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...base.checkpoint import OutOfTime
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate
from . import rule as decide
from .context import TraceContext
from .findings import CandidateFit, Pass
from .problem import EstimationProblem
from .refit import FittedModel, is_switched_off, refit, refit_from_declared
from .several import best_of_several
from .shortlist import Shortlist, score_effects, unpacked_shortlist
from .stored import packed_candidate, packed_refit, unpacked, unpacked_candidate

FITS = "fits"  # steps of this kind take as long as one another, item by item
NAMES = 4  # effects on the shortlist
NUMBERS = 2  # and described numbers that may be others
_BESIDE = 2  # beside effects added before: about a fit that lacks little a score says what a refit will
_FAINT = 0.02  # of the misfit: a score below this is not refitted, unless it is a rival of the best
_RIVAL = 0.25  # of the best score: below this no rival is refitted once nearly all is explained
_NEARLY_ALL = 0.95  # explained share; below it a score does not exclude a rival: numbers have taken what they can
_FORMULAS = 0.3  # of the explained share of its best formula: what a name must have for the others to be tried
_SECOND = 0.5  # of what the second of a pair must explain: what its best formula must have for the others to be tried
_FELT = 0.1  # of its range: what has a number at an end so far from where the effect is off may need more of it
_GONE = 1e-6  # of the misfit: as good as nothing is left
_WITH_MEMORY = 6.0  # fits without: what one with memory takes, about
_LOST = 0.05  # explained share below which a formula with memory says nothing of the name's other ones

Ranked = Sequence[tuple[Candidate, float]]
"""Candidates with their share of the misfit by the score test, most first."""


def run_pass(
    context: TraceContext,
    number: int,
    model_fit: FittedModel,
    before: FittedModel,
    share: float = decide.NAMED,
    equations: Collection[str] = (),
) -> Pass:
    """Shortlist, refit and judge against the misfit of `before`; an effect that explains `share` of it is accepted.
    Where none of the shortlist does, every other effect in `equations` is refitted, too.

    Where the time is over, of what was refitted until then. Raises OutOfTime before the shortlist."""
    shortlist = shortlist_of(context, number, model_fit)
    tried, finished = _Refits(context, number, model_fit, before, share, equations).of(shortlist.ranked)
    problem, misfit = context.problem, before.squares - before.samples
    lead = decide.lead_by_noise(misfit, problem.kappa, len(context.library))
    best = decide.named([candidate_fit.judgement for candidate_fit in tried], share, lead)
    tried = tuple(_with_ties(candidate_fit, best) for candidate_fit in tried)
    accepted = tuple(next(fit for fit in tried if fit.judgement is judgement) for judgement in best)
    ranked = shortlist.ranked, shortlist.compared, shortlist.cosines, shortlist.pairs
    return Pass(model_fit, *ranked, tried, accepted, finished)


def _with_ties(candidate_fit: CandidateFit, best: Sequence[decide.Judgement]) -> CandidateFit:
    """A refit, with the names of the other best ones where it is one of them."""
    others = tuple(judgement.name for judgement in best if judgement is not candidate_fit.judgement)
    return replace(candidate_fit, tied=others) if len(others) < len(best) else candidate_fit


def _shortest(able: Ranked, most: int, suspects: Sequence[str]) -> list[str]:
    """The first names of effects, and of described numbers that may be others; of these all `suspects`."""
    effects, numbers = (
        list(dict.fromkeys(c.effect.name for c, _ in able if bool(c.effect.shifts) is shifts))
        for shifts in (False, True)
    )
    others = [c.effect.name for c, _ in able if c.effect.shifts in suspects]
    return list(dict.fromkeys([*effects[:most], *numbers[:NUMBERS], *others]))


def _first_of(able: Ranked, name: str) -> Effect:
    """The formula of a name that scores best."""
    return next(pair[0].effect for pair in able if pair[0].effect.name == name)


def _neighbours(able: Ranked, fits: Sequence[CandidateFit]) -> list[str]:
    """The other names in the family of the refit that explains most, where it may be accepted: they tie with it unless
    refits exclude them, wherever their scores stand."""
    best = max(fits, key=lambda fit: fit.judgement.explained, default=None)
    if best is None or not best.judgement.passes or best.judgement.explained < decide.NAMED:
        return []
    return list(dict.fromkeys(pair[0].effect.name for pair in able if pair[0].effect.kin == best.judgement.kin))


def _may_be(effect: Effect, model_fit: FittedModel) -> bool:
    """Whether a candidate that shifts a number may: only one that went to an end of its range is contradicted."""
    return not effect.shifts or effect.shifts in model_fit.fit.at_bounds


def shortlist_of(
    context: TraceContext, number: int | str, model_fit: FittedModel, besides: Sequence[Effect] = ()
) -> Shortlist:
    """Scores about a fit, kept as a stage, of all candidates but those that it has, and those `besides`, which it had
    with one whose rivals are sought."""
    names = [effect.name for effect in (*model_fit.effects, *besides)]
    library = [effect for effect in context.library if effect.name not in names and _may_be(effect, model_fit)]

    def compute() -> dict[str, Any]:
        def report(names: Sequence[str]) -> None:
            context.steps.done(len(names))
            context.steps.say(f"scores of {', '.join(dict.fromkeys(names))}")

        context.steps.begin(f"pass {number}, scores of {len(library)} effects", "scores", len(library), ahead=2)
        return score_effects(context.workers, context.problem, model_fit, library, report, rivals=bool(besides))

    return unpacked_shortlist(context.stage(f"scores-{number}", compute), library)


class _Refits:
    """The refits of a pass beside `model_fit`, judged against the misfit of `before`."""

    def __init__(
        self,
        context: TraceContext,
        number: int,
        model_fit: FittedModel,
        before: FittedModel,
        share: float,
        equations: Collection[str] = (),
    ) -> None:
        self._equations = equations
        self._context, self._number, self._model_fit, self._before = context, number, model_fit, before
        self._had = decide.explained(before.squares, model_fit.squares, model_fit.samples)
        self._left = max(1 - self._had, _GONE)
        self._least = _SECOND * (share - self._had) / self._left if self._had else 0.0

    def of(self, ranked: Ranked) -> tuple[tuple[CandidateFit, ...], bool]:
        """Refits of the shortlist, most explained first, and whether the time sufficed for all of them.

        A refit decides which others are worth it. Workers that would wait go ahead with those that the scores promise;
        what was refitted in vain is left out of the answer, which so does not depend on how many workers there are.
        """
        tried: dict[str, CandidateFit] = {}
        steps, planned = self._context.steps, self._planned(ranked, tried)
        what = f"pass {self._number}, fits of {len(planned)} candidates or more"
        steps.begin(what, FITS, sum(map(_lasts, planned)), ahead=1)
        while ahead := [pair for pair in self._planned(ranked, tried) if pair[0].effect.title not in tried]:
            steps.remain(sum(map(_lasts, ahead)))
            try:
                tried |= self._refitted(ahead[: self._context.workers.count], first=not tried)
            except OutOfTime:
                break
        planned = self._planned(ranked, tried)
        fits = [tried[pair[0].effect.title] for pair in planned if pair[0].effect.title in tried]
        finished = not ahead
        if self._equations and finished and not self._is_explained(planned, tried):
            fits, finished = self._from_declared(fits)
        return tuple(sorted(fits, key=lambda candidate_fit: -candidate_fit.judgement.explained)), finished

    def _from_declared(self, fits: Sequence[CandidateFit]) -> tuple[list[CandidateFit], bool]:
        """The fits, those that explain a part made again from the numbers that the rig declares, and whether the time
        sufficed: numbers that have taken much of what is missing may not find back."""
        context, made = self._context, {fit.candidate.effect.title: fit for fit in fits}
        parts = [fit for fit in fits if fit.judgement.passes and fit.judgement.explained >= decide.PARTIAL]
        context.steps.begin(f"pass {self._number}, from declared numbers", FITS, len(parts), ahead=1)
        for part in parts:
            effect = part.candidate.effect
            context.steps.say(f"fit with {effect.title}")
            name = f"declared-{self._number}-{effect.name}-{effect.formula}"
            try:
                made[effect.title] = from_declared(context, name, part, self._model_fit, self._before)
            except OutOfTime:
                return list(made.values()), False
            context.steps.done()
        return list(made.values()), True

    def _planned(self, ranked: Ranked, tried: Mapping[str, CandidateFit]) -> list[tuple[Candidate, float]]:
        """The best formula of each name, then its others; what is not `tried` explains as much as its score says.

        Where no score explains anything, as about a rig that is far off by a delay, they rank nothing: more names are
        tried, those without memory first, and those with memory only where none of these explains the misfit.
        Scores do not choose among a name's formulas: a lag below a sample period is far from linear in its strength.
        """
        least = min(_FAINT, _RIVAL * ranked[0][1]) if ranked else _FAINT
        able = [pair for place, pair in enumerate(ranked) if place == 0 or pair[1] > least or self._is_suspect(pair)]
        most = _BESIDE if self._model_fit.known and not self._context.several else NAMES
        planned = list[tuple[Candidate, float]]()
        lost = bool(ranked) and ranked[0][1] < _LOST
        names = _shortest(able, (2 if lost else 1) * most, self._context.suspects)
        plain_first = sorted(names, key=lambda name: _first_of(able, name).has_memory) if lost else names
        for name in plain_first:
            if lost and _first_of(able, name).has_memory and self._is_explained(planned, tried):
                continue
            planned += self._formulas([pair for pair in able if pair[0].effect.name == name], ranked, planned, tried)
        for name in self._further(ranked, planned, tried):
            planned += self._formulas([pair for pair in ranked if pair[0].effect.name == name], ranked, planned, tried)
        fits = [tried.get(pair[0].effect.title) for pair in planned]
        had = [pair[0].effect.name for pair in planned]
        for name in _neighbours(able, [candidate_fit for candidate_fit in fits if candidate_fit]):
            if name not in had:
                planned += self._formulas([p for p in able if p[0].effect.name == name], ranked, planned, tried)
        return planned + self._formulas_of_best(ranked, fits)

    def _formulas(
        self, own: Ranked, ranked: Ranked, planned: Ranked, tried: Mapping[str, CandidateFit]
    ) -> list[tuple[Candidate, float]]:
        """Which of a name's `own` formulas to refit beside those that are `planned`: the best one first."""

        def explains(pair: tuple[Candidate, float]) -> float:
            candidate_fit = tried.get(pair[0].effect.title)
            return pair[1] if candidate_fit is None else self._of_left(candidate_fit)

        explained = max(map(explains, planned), default=0.0)
        is_faint = own[0][1] < _RIVAL * ranked[0][1] and not self._is_suspect(own[0])
        if explained >= _NEARLY_ALL and is_faint and self._is_explained(planned, tried):
            return []
        if self._context.several:
            return [own[0]]
        if explains(own[0]) >= max(_FORMULAS * max(explained, decide.PARTIAL), self._least):
            return [own[0], *self._other_formulas(own[0], ranked, tried)]
        if own[0][0].effect.has_memory and explains(own[0]) < _LOST and not self._least:
            return [own[0], *_others_with_memory(own[0][0].effect, ranked, explains)]
        return [own[0]]

    def _further(self, ranked: Ranked, planned: Ranked, tried: Mapping[str, CandidateFit]) -> list[str]:
        """The other names in the equations that lack something, where the shortlist, once tried, explains nothing: the
        score of an effect that is not linear in its strength, or which numbers mimic, says little."""
        if any(pair[0].effect.title not in tried for pair in planned) or self._is_explained(planned, tried):
            return []
        had = {pair[0].effect.name for pair in planned}
        names = (pair[0].effect.name for pair in ranked if self._may_sit(pair[0].effect))
        return [name for name in dict.fromkeys(names) if name not in had]

    def _may_sit(self, effect: Effect) -> bool:
        return not effect.shifts and effect.equation in self._equations

    def _is_explained(self, planned: Ranked, tried: Mapping[str, CandidateFit]) -> bool:
        """Whether one of the planned explains the misfit, now that they are tried: not one that leaves a misfit, and
        would be stronger than it may be, sits where nothing is missing, or is in a loop that somebody else closed,
        whose few signals let one effect mimic most of another."""
        fits = [tried[pair[0].effect.title] for pair in planned if pair[0].effect.title in tried]
        return any(self._of_left(fit) >= decide.NAMED and not self._is_doubtful(fit) for fit in fits)

    def _is_doubtful(self, candidate_fit: CandidateFit) -> bool:
        effect, refitted = candidate_fit.candidate.effect, candidate_fit.model_fit
        if refitted is None or not self._context.is_misfit(refitted):
            return False
        sits_elsewhere = self._equations and effect.equation not in self._equations
        if sits_elsewhere or self._context.problem.rig.inner:
            return True
        values = dict(zip(refitted.model.parameters, refitted.fit.p, strict=True))
        ends = [n for n in effect.fitted if n.off is not None and effect.key(n.name) in refitted.fit.at_bounds]
        return any(abs(values[effect.key(n.name)] - n.off) > _FELT * (n.high - n.low) for n in ends)

    def _is_suspect(self, pair: tuple[Candidate, float]) -> bool:
        return pair[0].effect.shifts in self._context.suspects

    def _of_left(self, candidate_fit: CandidateFit) -> float:
        """The share that a refit explains of what the fit that the pass goes on from leaves."""
        return (candidate_fit.judgement.explained - self._had) / self._left

    def _other_formulas(
        self, first: tuple[Candidate, float], ranked: Ranked, tried: Mapping[str, CandidateFit]
    ) -> list[tuple[Candidate, float]]:
        """A name's other formulas, those with memory last, and only while the others leave a misfit: they take several
        times as long, and with more numbers the rule would not prefer them."""
        own = [pair for pair in ranked if pair[0].effect.name == first[0].effect.name and pair is not first]
        plain = [pair for pair in own if not pair[0].effect.has_memory]
        fits = [tried.get(pair[0].effect.title) for pair in (first, *plain) if not pair[0].effect.has_memory]
        if any(fit is not None and fit.refitted and not self._context.is_misfit(fit.refitted) for fit in fits):
            return plain
        return plain + [pair for pair in own if pair[0].effect.has_memory]

    def _formulas_of_best(self, ranked: Ranked, fits: Sequence[CandidateFit | None]) -> list[tuple[Candidate, float]]:
        """The other formulas of the effect to add, once it is known, where several are missing."""
        known = [candidate_fit for candidate_fit in fits if candidate_fit is not None]
        if not self._context.several or len(known) < len(fits):
            return []
        best = best_of_several(self._context.problem, self._model_fit, known)
        return [pair for pair in ranked if best and pair[0].effect.name == best.judgement.name][1:]

    def _refitted(self, pairs: Ranked, first: bool) -> dict[str, CandidateFit]:
        """Refits by title; the `first` one of a pass may take a second start, but beside an effect with memory, where
        each takes several times as long."""
        context, number = self._context, self._number
        again = first and not any(effect.has_memory for effect in self._model_fit.effects)
        least = 0.0 if context.several else decide.VAIN
        items: dict[str, Any] = {}
        for place, (candidate, _) in enumerate(pairs):
            effect = candidate.effect
            context.steps.say(f"fit with {effect.title}")
            name = f"refit-{number}-{effect.name}-{effect.formula}"
            items[name] = packed_candidate(candidate) | {"again": again and place == 0, "least": least}
        results = context.workers(_refit, self._model_fit, items, context.stage, lambda _: None)
        context.steps.done(sum(map(_lasts, pairs)))
        return {pair[0].effect.title: self._judged(*pair, result) for pair, result in zip(pairs, results, strict=True)}

    def _judged(self, candidate: Candidate, share: float, stored: Mapping[str, Any]) -> CandidateFit:
        context, effect = self._context, candidate.effect
        if "failed" in stored:
            nothing = decide.Judgement(
                effect.name, effect.formula, 0.0, np.inf, len(effect.fitted), "it has no fit", effect.kin
            )
            return CandidateFit(candidate, share, nothing, None, stored["failed"])
        refitted = unpacked(stored, context.problem, context.library)
        judgement = judge(context, effect, self._model_fit, self._before, refitted)
        explained = 100 * judgement.explained
        context.report_progress(f"pass {self._number}: {effect.name} {effect.formula} explains {explained:.1f} %")
        return CandidateFit(candidate, share, judgement, refitted)


def from_declared(
    context: TraceContext, name: str, part: CandidateFit, model_fit: FittedModel, before: FittedModel
) -> CandidateFit:
    """A refit made again from the numbers that the rig declares, if that is better, as a stage with a `name`, judged
    as `judge` does. Raises OutOfTime."""
    found = context.fit(name, partial(refit_from_declared, context.problem, part.refitted))
    return replace(part, judgement=judge(context, part.candidate.effect, model_fit, before, found), model_fit=found)


def judge(
    context: TraceContext, effect: Effect, model_fit: FittedModel, before: FittedModel, refitted: FittedModel
) -> decide.Judgement:
    """What the rule says of an effect that `refitted` has beyond `model_fit`; shares are of the misfit of `before`."""
    n = model_fit.samples
    explained = decide.explained(before.squares, refitted.squares, n)
    squares = float(model_fit.fit.squares.sum()), float(refitted.fit.squares.sum())
    fall = decide.bic_fall(*squares, len(effect.fitted), context.problem.train.samples)
    against = decide.accident(model_fit.squares, refitted.squares, fall, context.problem.kappa, len(context.library))
    if not against and is_switched_off(refitted):
        against = "its fit takes it away again"
    chi2, numbers = refitted.squares / n, len(effect.fitted)
    return decide.Judgement(effect.name, effect.formula, explained, chi2, numbers, against, effect.kin)


def _lasts(pair: tuple[Candidate, float]) -> float:
    """About how many fits without memory the fit of a candidate takes as long as."""
    return _WITH_MEMORY if pair[0].effect.has_memory else 1.0


def _others_with_memory(
    first: Effect, ranked: Ranked, explains: Callable[[tuple[Candidate, float]], float]
) -> list[tuple[Candidate, float]]:
    """The name's other formulas with memory where one explains nothing, until one explains the misfit.

    A score at windows in which a loop hunts says little of such a formula.
    """
    others: list[tuple[Candidate, float]] = []
    for pair in ranked:
        effect = pair[0].effect
        if effect.name == first.name and effect.formula != first.formula and effect.has_memory:
            others.append(pair)
            if explains(pair) >= decide.NAMED:
                break
    return others


def _refit(
    problem: EstimationProblem, library: Sequence[Effect], model_fit: FittedModel, item: Mapping[str, Any]
) -> dict[str, Any]:
    """The fit with a candidate: see refit.py."""
    candidate = unpacked_candidate(item, library)
    return packed_refit(lambda: refit(problem, model_fit, candidate, item["again"], item["least"]))
