"""A rig's own shape: refinements of the effects that were found, and learned pieces where none was.

Where a fit leaves a misfit on what it did not see, every refinement of its effects and every learned piece of the
equation that lacks something is scored without a refit, the best are refitted, and one is kept if the rule that names
effects holds for it: BIC falls on the train records, the gain elsewhere is beyond chance, and is a part of the misfit
that matters. Then again, until nothing is missing or nothing passes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import lsq_linear

from ...base.errors import InputError
from ...plant.effects import Effect, EffectNumber, applies, learned, refinements
from ..fit.free_parameters import Candidate, extend_parameters, model_with
from ..fit.model import Model
from ..fit.normal_equations import numbers_at
from ..fit.solver import Fit, fit_numbers
from ..fit.windows import Windows
from . import rule as decide
from .problem import EstimationProblem
from .refit import FittedModel, with_selection
from .score import NuisanceProjection, initial_states_with_effect, worst_windows

TIERS = (2, 4, 9)  # further numbers: the next are asked only where nothing with fewer passes
REFITS = 3  # reshapings refitted in a tier
ROUNDS = 3
WORTH = 0.1  # of the misfit: a reshaping that takes away less is left out
_FAINT = 0.03  # of the misfit: a score below this is not refitted
_TRIED = 0.3  # of the way from off to typical: where a number is tried
_FARTHEST = 3.0  # times the way from off to typical: where a refit may start
_WEAKER = (1.0, 0.3, 0.1, 0.0)  # of the start: the first that does no harm
_ROUNDS = 12


@dataclass(frozen=True)
class Reshaping:
    """An effect in place of a known one, or beside all of them (`place` is None), and numbers SI to start from."""

    candidate: Candidate
    place: int | None

    def known(self, before: FittedModel) -> tuple[Candidate, ...]:
        """The effects of a fit with it."""
        known = list(before.known)
        if self.place is None:
            return (*known, self.candidate)
        known[self.place] = self.candidate
        return tuple(known)

    def further(self, before: FittedModel) -> tuple[str, ...]:
        """Its fitted numbers that the fit did not have."""
        had = () if self.place is None else [n.name for n in before.known[self.place].effect.numbers]
        return tuple(n.name for n in self.candidate.effect.fitted if n.name not in had)


def offered(problem: EstimationProblem, before: FittedModel, equation: str) -> tuple[list[Reshaping], ...]:
    """What a fit's effects could be refined to, and what could be learned in an equation: by TIERS, the cheapest first.

    Each tier holds those with at most so many further numbers, and more than the tier before.
    """
    own = [
        Reshaping(Candidate(effect, _numbers(before, candidate, effect)), place)
        for place, candidate in enumerate(before.known)
        for effect in refinements(candidate.effect, problem.samples)
    ]
    names = [candidate.effect.name for candidate in before.known]
    pieces = [piece for piece in learned(equation, problem.samples) if piece.name not in names]
    beside = [Reshaping(Candidate(effect, _numbers(before, None, effect)), None) for effect in pieces]
    able = [each for each in (*own, *beside) if applies(each.candidate.effect, problem.rig)]
    counts = [len(each.further(before)) for each in able]
    edges = pairwise((0, *TIERS))
    return tuple([e for e, n in zip(able, counts, strict=True) if low < n <= high] for low, high in edges)


def scored(
    problem: EstimationProblem, before: FittedModel, reshapings: Sequence[Reshaping]
) -> list[tuple[Reshaping, float]]:
    """Every reshaping that could pass with what it would take off the squared errors, less the price of its numbers,
    as a share of the misfit, most first; its numbers are where that is."""
    windows, fit = worst_windows(problem.train, before.fit)
    rest = NuisanceProjection(before.model, windows, fit)
    plain = before.model.errors(windows, fit.x0, fit.p)
    left, misfit = rest(plain), max(float(fit.squares.sum()) - windows.samples, 1.0)
    scores = []
    for each in reshapings:
        try:
            start, gain = _gain(problem, before, each, windows, fit, rest, plain, left)
        except (InputError, np.linalg.LinAlgError, RuntimeError):
            continue
        price = len(each.further(before)) * float(np.log(windows.samples))
        if gain - price > _FAINT * misfit:
            scores.append((replace(each, candidate=start), (gain - price) / misfit))
    return sorted(scores, key=lambda pair: -pair[1])


def refit_reshaped(problem: EstimationProblem, before: FittedModel, reshaping: Reshaping) -> FittedModel:
    """The fit with a reshaping, all numbers free."""
    known = reshaping.known(before)
    model = model_with(problem.rig, [candidate.effect for candidate in known], problem.train.names)
    own = {free.name: float(x) for free, x in zip(before.fit.free, before.fit.x, strict=True)}
    names = [candidate.effect.key(n.name) for candidate in known for n in candidate.effect.fitted]
    rig_free = [free for free in before.fit.free if free.name not in names]
    free = (*rig_free, *(number for candidate in known for number in candidate.free()))
    fit: Fit | None = None
    for share in _WEAKER:
        weaker = replace(reshaping, candidate=_weakened(before, reshaping, share))
        values = {f.name: f.value(own.get(f.name, 0.0)) for f in free} | _values(weaker.candidate)
        start = np.array([f.normalised(values[f.name]) for f in free])
        p = numbers_at(model, free, start, extend_parameters(before.model.plant, before.fit.p, model.plant))
        guess = initial_states_with_effect(model, before.model, problem.train, before.fit.x0, p)
        squares = sum(float(np.sum(e**2)) for e in model.errors(problem.train, guess, p))
        if squares < before.fit.squares.sum() or share is _WEAKER[-1]:
            fit = fit_numbers(model, problem.train, free, start, p, guess, problem.kappas, _ROUNDS)
            break
    assert fit is not None
    return with_selection(problem, model, fit, known)


def best(
    problem: EstimationProblem, before: FittedModel, refits: Sequence[tuple[Reshaping, FittedModel]], candidates: int
) -> tuple[Reshaping, FittedModel] | None:
    """The refit with the fewest numbers of those within TIED of the best, if it passes the rule; else None."""
    misfit = before.squares - before.samples
    able = [pair for pair in refits if _passes(problem, before, *pair, candidates)]
    if not able:
        return None
    least = min(after.squares for _, after in able)
    near = [pair for pair in able if pair[1].squares <= least + decide.TIED * misfit]
    return min(near, key=lambda pair: (len(pair[1].fit.free), pair[1].squares))


def _passes(
    problem: EstimationProblem, before: FittedModel, reshaping: Reshaping, after: FittedModel, candidates: int
) -> bool:
    squares = float(before.fit.squares.sum()), float(after.fit.squares.sum())
    fall = decide.bic_fall(*squares, len(reshaping.further(before)), problem.train.samples)
    real = decide.passes(before.squares, after.squares, fall, problem.kappa, candidates)
    return real and decide.explained(before.squares, after.squares, before.samples) >= WORTH


def _gain(
    problem: EstimationProblem,
    before: FittedModel,
    reshaping: Reshaping,
    windows: Windows,
    fit: Fit,
    rest: NuisanceProjection,
    plain: Sequence[np.ndarray],
    left: np.ndarray,
) -> tuple[Candidate, float]:
    """The numbers from which to refit, and the fall of the squared errors of a linear model in its further numbers."""
    known, effect = reshaping.known(before), reshaping.candidate.effect
    model = model_with(problem.rig, [candidate.effect for candidate in known], windows.names, brief=True)
    strong = [n for n in effect.fitted if n.name in reshaping.further(before) and n.off is not None]
    shapes = [(n.name, value) for n in effect.fitted for value in n.tried if n.name in reshaping.further(before)]
    best_start, best_gain = reshaping.candidate, 0.0
    for shape in [(), *((entry,) for entry in shapes)]:
        start = dict(reshaping.candidate.start) | dict(shape)
        columns = []
        for number in strong:
            tried = start | {number.name: float((number.off or 0) + _TRIED * (number.typical - (number.off or 0)))}
            change = _changed(model, before, replace(reshaping.candidate, start=tried), windows, fit, plain)
            columns.append(np.zeros_like(left) if change is None else rest(change) / _TRIED)
        g = np.array(columns).T
        if not columns or not np.any(g):
            continue
        weight = lsq_linear(g, -left, bounds=np.transpose([_reach(number) for number in strong])).x
        gain = float(left @ left - np.sum((left + g @ weight) ** 2))
        if gain > best_gain:
            for number, w in zip(strong, weight.tolist(), strict=True):
                off = number.off or 0.0
                start[number.name] = float(np.clip(off + w * (number.typical - off), number.low, number.high))
            best_start, best_gain = replace(reshaping.candidate, start=start), gain
    return best_start, best_gain


def _reach(number: EffectNumber) -> tuple[float, float]:
    """How far a number may go from off, in steps from off to typical."""
    off = number.off or 0.0
    low, high = sorted((end - off) / (number.typical - off) for end in (number.low, number.high))
    return max(low, -_FARTHEST), min(high, _FARTHEST)


def _changed(
    model: Model,
    before: FittedModel,
    candidate: Candidate,
    windows: Windows,
    fit: Fit,
    plain: Sequence[np.ndarray],
) -> list[np.ndarray] | None:
    """What a reshaping with these numbers changes in the errors of every group; None where it cannot be simulated."""
    p = extend_parameters(before.model.plant, fit.p, model.plant)
    p = model.plant.parameter_values(p, **_values(candidate))
    x0 = initial_states_with_effect(model, before.model, windows, fit.x0, p)
    changed = [a - b for a, b in zip(model.errors(windows, x0, p), plain, strict=True)]
    return changed if all(np.isfinite(part).all() for part in changed) else None


def _values(candidate: Candidate) -> dict[str, float]:
    return {candidate.effect.key(name): value for name, value in candidate.start.items()}


def _numbers(before: FittedModel, candidate: Candidate | None, effect: Effect) -> dict[str, float]:
    """Numbers of an effect: those that were fitted where it had them before, else off, else typical."""
    values = dict(zip(before.model.plant.parameters, before.fit.p.tolist(), strict=True))
    had = {} if candidate is None else {n.name: values[candidate.effect.key(n.name)] for n in candidate.effect.numbers}
    return {n.name: n.typical if n.off is None else n.off for n in effect.numbers} | had


def _weakened(before: FittedModel, reshaping: Reshaping, share: float) -> Candidate:
    """The candidate with its further numbers nearer to off."""
    further = reshaping.further(before)
    start = {
        n.name: n.off + share * (value - n.off) if n.name in further and n.off is not None else value
        for n in reshaping.candidate.effect.numbers
        for value in [reshaping.candidate.start[n.name]]
    }
    return replace(reshaping.candidate, start=start)
