"""Trace the misfit of frequency-response sheets to the effect that a model lacks: fit, gate, shortlist, refit, decide.

The rule is that of recordings (see trace/rule.py), with gains and phases for samples, whose errors count as white.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate, at_strength, extend_parameters
from ..trace import rule
from .fit import Errors, SheetFit, fitted_sheets, heldout_squares, train_deviations
from .problem import SheetProblem
from .remainder import Band, bands, with_element
from .shortlist import SheetScore, scores

NAMES = 4  # effects that are refitted
_FAINT = 0.02  # of the misfit: a score below this is not refitted, unless it is the best
_RIVAL = 0.6  # of the best score: below this no rival is refitted once the misfit is explained
_FORMULAS = 0.8  # of the explained share of its best formula: what a name must have for the others to be tried
_PASSES = 3  # effects at most
_MOST = 2 / 3  # of the misfit: an effect that explains that much is named, as incomplete,
_CLEAR = 0.1  # if no effect of another family comes as near as that
_KAPPA = 1.0

Report = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class SheetCandidate:
    """A refitted effect and what the rule says of it."""

    effect: Effect
    judgement: rule.Judgement
    fit: SheetFit


@dataclass(frozen=True, eq=False)
class JudgedFit:
    """A fit on the points that judge: squared errors [points], deviations [k, 2] of each sheet (dB, degrees)."""

    squares: np.ndarray
    deviations: Sequence[np.ndarray]
    samples: int

    @property
    def chi2(self) -> float:
        """Squared errors over samples."""
        return float(self.squares.sum()) / self.samples


@dataclass(frozen=True, eq=False)
class SheetTrace:
    """What a trace of sheets found, as `Trace` has it for recordings; `tried` are refits, most explained first.

    `named` is the fit with the effects, `final` that with what was learned behind it; `judged` are the rig alone and
    those two; `left` says where the second of them is plainly wrong.
    """

    problem: SheetProblem
    base: SheetFit
    named: SheetFit
    final: SheetFit
    judged: tuple[JudgedFit, JudgedFit, JudgedFit]
    left: tuple[Band, ...]
    verdict: str
    effects: tuple[SheetCandidate, ...]
    tied: tuple[str, ...]
    equation: str | None
    tried: tuple[SheetCandidate, ...]
    shortlist: tuple[SheetScore, ...]

    def alike(self, named: SheetCandidate) -> tuple[Effect, ...]:
        """The other formulas of an effect that was named that explain the sheets as well as its own, within TIED."""
        least = named.judgement.explained - rule.TIED
        own = [each for each in self.tried if each.effect.name == named.effect.name and each is not named]
        return tuple(each.effect for each in own if each.judgement.passes and each.judgement.explained >= least)


def trace_sheets(problem: SheetProblem, library: Sequence[Effect], report: Report) -> SheetTrace:
    """Trace sheets to effects of `library`, those that act where the sheets were measured. Raises InputError."""
    library = [effect for effect in library if problem.bench.has_room(effect)]
    model = problem.model()
    errors = Errors(problem, model, problem.uncertain(model), model.plant.p)
    report(f"fit of {len(errors.free)} numbers of {problem.rig.name}")
    base = fitted_sheets(problem, errors, np.zeros(len(errors.free)))
    report(f"rig alone: chi2 {base.squares / problem.samples:.4g} on points that it did not see")
    search = _Search(problem, library, report, base, errors)
    if _misfit(problem, base):
        search.run()
    return _result(search)


class _Search:
    """Effects one after the other, until nothing is missing or nothing passes."""

    def __init__(
        self, problem: SheetProblem, library: Sequence[Effect], report: Report, base: SheetFit, errors: Errors
    ) -> None:
        self.problem, self.base, self.errors = problem, base, errors
        self._library, self.report = library, report
        self.effects: tuple[SheetCandidate, ...] = ()
        self.tied: tuple[str, ...] = ()
        self.tried: tuple[SheetCandidate, ...] = ()
        self.shortlist: tuple[SheetScore, ...] = ()

    @property
    def last(self) -> SheetFit:
        """The fit with all effects so far."""
        return self.effects[-1].fit if self.effects else self.base

    def run(self) -> None:
        """Fill in `effects`."""
        first, n = self.base.squares, self.problem.samples
        while len(self.effects) < _PASSES and _misfit(self.problem, self.last):
            if not rule.worth_adding(self.last.squares, first, n):
                return  # not even an effect that left nothing
            tried = self._pass()
            accepted = rule.named([candidate.judgement for candidate in tried])
            best = [candidate for candidate in tried if candidate.judgement in accepted[:1]]
            if not best and not self.effects:
                best = _partial(tried)
            if not best or not rule.worth_adding(self.last.squares - best[0].fit.squares, first, n):
                return
            self.tied = self.tied or tuple(judgement.name for judgement in accepted[1:])
            self.effects = (*self.effects, best[0])

    def _pass(self) -> tuple[SheetCandidate, ...]:
        """Shortlist and refits beside the effects so far, most explained first."""
        last = self.last
        names = [effect.name for effect in last.model.effects]
        library = [effect for effect in self._library if effect.name not in names]
        errors = Errors(self.problem, last.model, last.fit.free, last.fit.p)
        own = len(self.base.fit.free)
        x = np.concatenate((np.zeros(own), last.fit.x[own:]))
        thinned = replace(errors, problem=self.problem.thinned())
        ranked = scores(thinned, x, library, lambda effect: self.report(f"score of {effect.title}"))
        tried = self._refits(errors, x, ranked)
        if not self.effects:
            self.shortlist = tuple(ranked)
        self.tried = (*self.tried, *tried)
        return tried

    def _refits(self, errors: Errors, x: np.ndarray, ranked: Sequence[SheetScore]) -> tuple[SheetCandidate, ...]:
        """The best formula of each name, then its other formulas where it comes near to the best of all."""
        able = [score for place, score in enumerate(ranked) if place == 0 or score.share > _FAINT]
        names = list(dict.fromkeys(score.candidate.effect.name for score in able))[:NAMES]
        own = {name: [score for score in able if score.candidate.effect.name == name] for name in names}
        tried: list[SheetCandidate] = []
        for name in names:
            most = max((candidate.judgement.explained for candidate in tried), default=0.0)
            if most < rule.NAMED or own[name][0].share > _RIVAL * ranked[0].share:
                tried.append(self._refit(errors, x, own[name][0].candidate, again=most < rule.NAMED))
        most = max((candidate.judgement.explained for candidate in tried), default=0.0)
        for candidate in tuple(tried):
            if candidate.judgement.explained >= _FORMULAS * max(most, rule.PARTIAL):
                tried += [self._refit(errors, x, score.candidate) for score in own[candidate.judgement.name][1:]]
        return tuple(sorted(tried, key=lambda candidate: -candidate.judgement.explained))

    def _refit(self, errors: Errors, x: np.ndarray, candidate: Candidate, again: bool = False) -> SheetCandidate:
        """All numbers fitted with one more effect, from the declared ones.

        `again`: where that leaves something, also from those without the effect, and with the effect as it is
        typically, and the best of the three counts.
        """
        last, effect = self.last, candidate.effect
        fit = self._fitted(errors, x, candidate)
        typical = Candidate(effect, at_strength(effect, 1.0))
        for other in ((last.fit.x, candidate), (x, typical)) if again else ():
            if fit.fit.chi2 > rule.CLOSED:
                fit = min(fit, self._fitted(errors, *other), key=lambda each: float(each.fit.squares.sum()))
        judgement = _judged(self.problem, last, fit, effect, len(self._library))
        self.report(f"{effect.title} explains {100 * judgement.explained:.1f} %")
        return SheetCandidate(effect, judgement, fit)

    def _fitted(self, errors: Errors, x: np.ndarray, candidate: Candidate) -> SheetFit:
        """The fit with one more effect from where `candidate` begins it, and distances x of the numbers so far."""
        last, more = self.last, candidate.free()
        model = self.problem.model((*last.model.effects, candidate.effect))
        p = extend_parameters(last.model.plant, last.fit.p, model.plant)
        whole = Errors(self.problem, model, (*errors.free, *more), p)
        return fitted_sheets(self.problem, whole, np.append(x, np.zeros(len(more))))


def _judged(
    problem: SheetProblem, before: SheetFit, after: SheetFit, effect: Effect, candidates: int
) -> rule.Judgement:
    n, numbers = problem.samples, len(effect.fitted)
    fall = rule.bic_fall(float(before.fit.squares.sum()), float(after.fit.squares.sum()), numbers, n)
    against = rule.accident(before.squares, after.squares, fall, _KAPPA, candidates)
    explained = rule.explained(before.squares, after.squares, n)
    return rule.Judgement(effect.name, effect.formula, explained, after.squares / n, numbers, against, effect.kin)


def _deviation(samples: int) -> float:
    """Standard deviation of the chi2 of white errors of a size that is known."""
    return float(np.sqrt(2 / samples))


def _misfit(problem: SheetProblem, fit: SheetFit) -> bool:
    return rule.misfit(fit.squares / problem.samples, _deviation(problem.samples))


def _partial(tried: Sequence[SheetCandidate]) -> list[SheetCandidate]:
    """The effect that explains most of the misfit, though not enough of it, where no other family comes near."""
    able = [each for each in tried if each.judgement.passes and each.judgement.explained >= _MOST]
    if not able:
        return []
    others = [each for each in tried if each.effect.kin != able[0].effect.kin]
    near = any(each.judgement.explained > able[0].judgement.explained - _CLEAR for each in others)
    return [] if near else able[:1]


def _result(search: _Search) -> SheetTrace:
    """What the points that judge make of a search, which ends before they are looked at."""
    problem, effects, tied = search.problem, search.effects, search.tied
    before = _judge(problem, search.base)
    named, plain = search.base, before
    if effects:
        last = _judge(problem, search.last)
        if _borne_out(before, last):
            named, plain = search.last, last
        else:
            effects, tied = (), ()
    missing = _missing(plain) or _misfit(problem, named)  # few points that judge may miss what the others show
    verdict = (
        "tied" if tied else ("incomplete" if missing else "named") if effects else "unknown" if missing else "none"
    )
    final, after = _learned(search, named, plain) if missing else (named, plain)
    left = _left(problem, named, plain) if missing else []
    equation = effects[0].effect.equation if effects else _place(search) if verdict == "unknown" else None
    return SheetTrace(
        problem, search.base, named, final, (before, plain, after), tuple(left), verdict, effects, tied, equation,
        search.tried, search.shortlist,
    )  # fmt: skip


def _left(problem: SheetProblem, named: SheetFit, judged: JudgedFit) -> list[Band]:
    """The bands in which a fit is plainly wrong, on all points: fitted ones lie between those that judge."""
    fitted = train_deviations(problem, named) if problem.heldout else []
    return bands(problem.sheets, [*fitted, *judged.deviations], problem.sigma)


def _borne_out(before: JudgedFit, after: JudgedFit) -> bool:
    """Whether the points that judge bear out what was found: nothing is missing with it, or most of the misfit goes."""
    return not _missing(after) or (
        rule.explained(float(before.squares.sum()), float(after.squares.sum()), before.samples) >= _MOST
    )


def _missing(judged: JudgedFit) -> bool:
    return rule.misfit(judged.chi2, _deviation(judged.samples))


def _learned(search: _Search, named: SheetFit, plain: JudgedFit) -> tuple[SheetFit, JudgedFit]:
    """The fit with an element for what is left, if the points that judge bear it out; else as named."""
    search.report("what is left, as one linear element")
    learned = with_element(search.problem, named)
    judged = learned and _judge(search.problem, learned)
    return (learned, judged) if learned and judged and judged.chi2 < plain.chi2 else (named, plain)


def _judge(problem: SheetProblem, fit: SheetFit) -> JudgedFit:
    squares, deviations = heldout_squares(problem, fit)
    judged = JudgedFit(squares, deviations, sum(s.stated for s in problem.heldout) or problem.samples)
    if not np.isfinite(judged.chi2):
        raise InputError(f"{problem.source}: {problem.rig.name} gives no such response; check the sheet")
    return judged


def _place(search: _Search) -> str | None:
    """The equation of the effect that explains most, where none is named."""
    tried = sorted(search.tried, key=lambda candidate: -candidate.judgement.explained)
    return tried[0].effect.equation if tried else None
