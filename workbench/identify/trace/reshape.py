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
from ..fit.free_parameters import Candidate, extend_parameters
from ..fit.model import Model
from ..fit.normal_equations import numbers_at
from ..fit.solver import fit_numbers
from . import rule as decide
from .problem import EstimationProblem
from .refit import FittedModel, with_selection
from .score import NuisanceProjection, initial_states_with_effect, worst_windows

TIERS = (2, 4, 11)  # further numbers: the next are asked only where nothing with fewer does
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
    test = _ScoreTest(problem, before)
    scores = []
    for each in reshapings:
        try:
            start, gain = test.gain(each)
        except (InputError, np.linalg.LinAlgError, RuntimeError):
            continue
        price = len(each.further(before)) * float(np.log(test.windows.samples))
        if gain - price > _FAINT * test.misfit:
            scores.append((replace(each, candidate=start), (gain - price) / test.misfit))
    return sorted(scores, key=lambda pair: -pair[1])


def refit_reshaped(problem: EstimationProblem, before: FittedModel, reshaping: Reshaping) -> FittedModel:
    """The fit with a reshaping, all numbers free."""
    known = reshaping.known(before)
    model = problem.model([candidate.effect for candidate in known])
    own = {free.name: float(x) for free, x in zip(before.fit.free, before.fit.x, strict=True)}
    names = [candidate.effect.key(n.name) for candidate in known for n in candidate.effect.fitted]
    rig_free = [free for free in before.fit.free if free.name not in names]
    free = (*rig_free, *(number for candidate in known for number in candidate.free()))

    def begin(share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances, parameters and initial states with the further numbers nearer to off."""
        weaker = _values(_weakened(before, reshaping, share))
        values = {f.name: f.value(own.get(f.name, 0.0)) for f in free} | weaker
        start = np.array([f.normalised(values[f.name]) for f in free])
        p = numbers_at(model, free, start, extend_parameters(before.model.plant, before.fit.p, model.plant))
        return start, p, initial_states_with_effect(model, before.model, problem.train, before.fit.x0, p)

    start, p, guess = begin(_WEAKER[0])
    for share in _WEAKER[1:]:
        squares = sum(float(np.sum(e**2)) for e in model.errors(problem.train, guess, p))
        if squares < before.fit.squares.sum():
            break
        start, p, guess = begin(share)
    fit = fit_numbers(model, problem.train, free, start, p, guess, problem.kappas, _ROUNDS, near=True)
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
    real = not decide.accident(before.squares, after.squares, fall, problem.kappa, candidates)
    return real and decide.explained(before.squares, after.squares, before.samples) >= WORTH


class _ScoreTest:
    """What reshapings would change in the windows where a fit is most wrong, beside all that its numbers can do."""

    def __init__(self, problem: EstimationProblem, before: FittedModel) -> None:
        self._problem, self._before = problem, before
        self.windows, self._fit = worst_windows(problem.train, before.fit)
        self._rest = NuisanceProjection(before.model, self.windows, self._fit)
        self._plain = before.model.errors(self.windows, self._fit.x0, self._fit.p)
        self._left = self._rest(self._plain)
        self.misfit = max(float(self._fit.squares.sum()) - self.windows.samples, 1.0)

    def gain(self, reshaping: Reshaping) -> tuple[Candidate, float]:
        """The numbers to start a refit from, and the fall of the squared errors linear in its further numbers."""
        effects = [candidate.effect for candidate in reshaping.known(self._before)]
        model = self._problem.model(effects, brief=True)
        further = reshaping.further(self._before)
        own = [n for n in reshaping.candidate.effect.fitted if n.name in further]
        strong, best, most = [n for n in own if n.off is not None], reshaping.candidate, 0.0
        for shape in [{}, *({n.name: value} for n in own for value in n.tried)]:
            candidate = replace(reshaping.candidate, start=dict(reshaping.candidate.start) | shape)
            columns = np.array([self._change(model, candidate, number) for number in strong]).T
            if not columns.size or not np.any(columns):
                continue
            steps = lsq_linear(columns, -self._left, bounds=np.transpose([_reach(number) for number in strong])).x
            gain = float(self._left @ self._left - np.sum((self._left + columns @ steps) ** 2))
            if gain > most:
                best, most = _moved(candidate, strong, steps.tolist()), gain
        return best, most

    def _change(self, model: Model, candidate: Candidate, number: EffectNumber) -> np.ndarray:
        """Change of the errors per step of a number from off to typical; 0 where it cannot be simulated."""
        p = extend_parameters(self._before.model.plant, self._fit.p, model.plant)
        p = model.plant.parameter_values(p, **_values(_moved(candidate, [number], [_TRIED])))
        x0 = initial_states_with_effect(model, self._before.model, self.windows, self._fit.x0, p)
        errors = model.errors(self.windows, x0, p)
        changed = [a - b for a, b in zip(errors, self._plain, strict=True)]
        if not all(np.isfinite(part).all() for part in changed):
            return np.zeros_like(self._left)
        return self._rest(changed) / _TRIED


def _moved(candidate: Candidate, numbers: Sequence[EffectNumber], steps: Sequence[float]) -> Candidate:
    """A candidate with numbers so many steps of off to typical away from off, within their ranges."""
    start = dict(candidate.start)
    for number, step in zip(numbers, steps, strict=True):
        off = number.off or 0.0
        start[number.name] = float(np.clip(off + step * (number.typical - off), number.low, number.high))
    return replace(candidate, start=start)


def _reach(number: EffectNumber) -> tuple[float, float]:
    """How far a number may go from off, in steps from off to typical."""
    off = number.off or 0.0
    low, high = sorted((end - off) / (number.typical - off) for end in (number.low, number.high))
    return max(low, -_FARTHEST), min(high, _FARTHEST)


def _values(candidate: Candidate) -> dict[str, float]:
    return {candidate.effect.key(name): value for name, value in candidate.start.items()}


def _numbers(before: FittedModel, candidate: Candidate | None, effect: Effect) -> dict[str, float]:
    """Numbers of an effect: those that were fitted where it had them before, else off, else typical."""
    values = dict(zip(before.model.parameters, before.fit.p.tolist(), strict=True))
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
