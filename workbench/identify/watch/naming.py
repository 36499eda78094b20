"""What a change is: suspects compete by first order about the alarm, then by fits to sessions before and after it.

While a change is small, every axis is a line, and all sessions together say whose line it is: numbers of the rig,
effects and sensors alike. A seal that leaks six times as much is no line any more. So the best few by first order,
about the alarm and on the newest session, are fitted, one at a time; the rig's other numbers may move as healthy ones.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ...plant.effects import Effect
from ...rigs.number import Number
from ...rigs.rig import Rig
from ..fit.free_parameters import Candidate, at_strength
from ..fit.model import Model
from ..fit.solver import Fit
from ..fit.windows import Windows
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel, refit, refit_all_windows, with_selection
from ..trace.rule import PAIR
from ..trace.score import NuisanceProjection
from .changes import gains
from .history import History, marginal, wander
from .session_evidence import COMMAND, command_changes, near_fit, sensor_changes, with_signal

SUSPECTS, NEAREST = 6, 3  # fitted about the alarm; those of them that leave least, on the newest session too
LEAVES = 2.0  # times what the best suspect leaves of a change: who leaves no more explains it as well
SURE = 30.0  # squared errors over sigma, that count as nothing left
NAMED = 0.5  # of the change: a suspect that explains less is not its name
MOST_NAMES = 4
SECOND = 0.1  # of a change: what a second suspect has to take beside an effect, whose formula may be another one,
BESIDE = 0.005  # and beside a number or a signal, which leave nothing;
OF_LEFT = 4.0  # and what is left without either, over what both leave
WEAR = 15.0  # a number may become so many times more or less
_ROUNDS, _AGAIN = 10, 2
_START = 0.3  # of an effect's typical strength
_LESS = 2.0  # deviations below nothing, that an effect which has one way only may seem to have
Problem = Callable[[Rig], EstimationProblem]


@dataclass(frozen=True)
class Explained:
    """What a suspect makes of one session: the squared errors with the rig as it was, and with it, of so many samples;
    its value, SI or of an effect's typical strength, with the standard deviation; all numbers of the rig, those of the
    effect too."""

    before: float
    after: float
    samples: int
    value: float
    deviation: float
    numbers: Mapping[str, float]


Suspects = tuple[str, ...]
Explanations = dict[Suspects, dict[str, Explained]]  # what suspects, one or several together, make of a session


def suspects(known: History, told: int, moves: np.ndarray) -> list[int]:
    """The axes [SUSPECTS] that explain most to first order: of all sessions up to the one that `told` of the change,
    and of the newest, beyond the moves [n] before it; from both in turn."""
    ranked = (_until(known.until(told + 1)), _newest(known, moves))
    orders = [np.argsort(gain)[::-1].tolist() for gain in ranked]
    turns = [axis for pair in zip(*orders, strict=True) for axis in pair]
    return list(dict.fromkeys(turns))[:SUSPECTS]


def _until(known: History) -> np.ndarray:
    """Gains [n] of a change of each axis over sessions: of its best beginning and shape, if the axis can go there."""
    rest = marginal(known, wander(known))
    gain, size = gains(rest, known.days, rest.vector[..., None])
    way = np.array([axis.one_way for axis in known.axes])
    return np.where(way & (size[..., 0] < 0), 0.0, gain[..., 0]).max(axis=0)


def _newest(known: History, moves: np.ndarray) -> np.ndarray:
    """Gains [n] of each axis in the newest session, 0 where that tells nothing of it; those of the rig's numbers that
    are not meant wander as healthy ones do."""
    matrix, k = known.matrix[-1], known.numbers
    left = known.vector[-1] - matrix @ moves
    held = np.diag(1.0 / wander(known)[:k])
    own = np.linalg.solve(matrix[:k, :k] + held, np.column_stack((left[:k], matrix[:k])))
    usual = float(left[:k] @ own[:, 0])
    gain = np.zeros(len(known.axes))
    for j, axis in enumerate(known.axes):
        if not matrix[j, j]:
            continue
        if j < k:
            free = held * (np.arange(k) != j)
            gain[j] = float(left[:k] @ np.linalg.solve(matrix[:k, :k] + free, left[:k])) - usual
            continue
        size = left[j] - matrix[j, :k] @ own[:, 0]
        known_size = max(matrix[j, j] - matrix[j, :k] @ own[:, 1 + j], 1e-12)
        less = size / known_size + moves[j] < -_LESS / np.sqrt(known_size)
        gain[j] = 0.0 if axis.one_way and less else size**2 / known_size
    return gain


def explainer(problem: Problem, rig: Rig, library: Sequence[Effect]) -> Callable[[Sequence[str]], dict[str, Explained]]:
    """A function: suspects -> what they, together, make of one session, by the value of each. Its problem is made for a
    rig that is held to what healthy ones do; the fit without a suspect is computed once, when it is first needed.

    The function raises InputError where no fit is near.
    """
    formulas = {effect.name: effect for effect in reversed(library)}

    @cache
    def without() -> tuple[EstimationProblem, FittedModel]:
        own = problem(rig)
        return own, with_selection(own, own.model(), near_fit(own), ())

    def explained(axes: Sequence[str]) -> dict[str, Explained]:
        own, was = without()
        worn = {axis: _worn(rig.numbers[axis]) for axis in axes if axis in rig.numbers}
        effects = [formulas[axis] for axis in axes if axis in formulas]
        signals = [axis for axis in axes if axis not in worn and axis not in formulas]
        at, found, sizes = own, was, {}
        if worn:
            at = problem(replace(rig, numbers={**rig.numbers, **worn}))
            fit = near_fit(at, _ROUNDS, _numbers(was.model, was.fit))
            found = with_selection(at, at.model(), fit, ())
        whole = at.train
        if signals:
            at, found, sizes = _with_signals(at, found, signals, whole, {})
        for effect in effects:
            found = refit(at, found, Candidate(effect, at_strength(effect, _START)))
        if signals and effects:
            at, found, sizes = _with_signals(at, found, signals, whole, sizes)
        squares = float(was.fit.squares.sum()), float(found.fit.squares.sum())
        numbers = _numbers(found.model, found.fit)
        values = (
            sizes
            | {axis: (numbers[axis], _deviation(found.fit, axis)) for axis in worn}
            | {effect.name: _strength(effect, numbers, found.fit) for effect in effects}
        )
        return {axis: Explained(*squares, found.fit.samples, *values[axis], numbers) for axis in axes}

    return explained


def _worn(number: Number) -> Number:
    ends = sorted((number.value / WEAR, number.value * WEAR))
    return replace(number, low=ends[0], high=ends[1])


def _strength(effect: Effect, numbers: Mapping[str, float], fit: Fit) -> tuple[float, float]:
    """An effect's strength, of its typical one, with the standard deviation."""
    strong = next(n for n in effect.fitted if n.off is not None)
    off = strong.off or 0.0
    reach, name = strong.typical - off, effect.key(strong.name)
    return (numbers[name] - off) / reach, _deviation(fit, name) / abs(reach)


def _numbers(model: Model, fit: Fit) -> dict[str, float]:
    return dict(zip(model.parameters, fit.p.tolist(), strict=False))


def _deviation(fit: Fit, name: str) -> float:
    low, high = fit.interval([each.name for each in fit.free].index(name))
    return max(high - low, 0.0) / 3.92


def _with_signals(
    at: EstimationProblem,
    found: FittedModel,
    names: Sequence[str],
    whole: Windows,
    sizes: Mapping[str, tuple[float, float]],
) -> tuple[EstimationProblem, FittedModel, dict[str, tuple[float, float]]]:
    """Scales or zeros of sensors, or of the drive's input, by tangents, each from where the one before led, with their
    standard deviations; of the windows as a `whole` was recorded."""
    size, deviation = np.array([sizes.get(name, (0.0, 0.0))[0] for name in names]), np.zeros(len(names))
    for _ in range(_AGAIN):
        rest = NuisanceProjection(found.model, at.train, found.fit)
        kinds = {command_changes if name.startswith(f"{COMMAND}.") else sensor_changes for name in names}
        changes = [each for kind in kinds for each in kind(at, found.model, found.fit, rest.errors)]
        axes = [next(each for each in changes if each[0].name == name) for name in names]
        columns = np.column_stack([rest(change) for _, change in axes])
        scales = np.array([axis.scale for axis, _ in axes])
        covariance = np.linalg.inv(columns.T @ columns + 1e-12 * np.eye(len(names)))
        size = size - covariance @ columns.T @ rest(rest.errors) * scales
        deviation = scales * np.sqrt(at.kappa * np.diag(covariance))
        windows = whole
        for name, own in zip(names, size.tolist(), strict=True):
            moved = (own, 0.0) if name.endswith(".scale") else (0.0, own)
            windows = with_signal(windows, name.rpartition(".")[0], *moved)
        at = replace(at, train=windows)
        found = refit_all_windows(at, found) if found.known else with_selection(at, found.model, near_fit(at), ())
    return at, found, {name: (size[k], deviation[k]) for k, name in enumerate(names)}


@dataclass(frozen=True)
class Name:
    """Who explains a change: the best suspect, None where none explains NAMED of it; those that do as well; and the
    share of the change that the best explains."""

    axis: str | None
    among: tuple[str, ...]
    share: float


def nearest(usual: float, found: Mapping[str, Explained]) -> list[str]:
    """The suspects that leave least of one session, best first; `usual`: chi2 of sessions before the change."""
    return sorted(found, key=lambda axis: _left(found[axis], usual))[:NEAREST]


def name_of(usual: float, new: Mapping[str, Sequence[Explained]]) -> Name:
    """The name of a change, of every suspect on the same sessions after it; `usual`: chi2 of sessions before it.

    Every session counts alike: a formula that is not quite the rig's leaves most where the change is largest.
    """
    left = {axis: float(np.mean([_left(each, usual) for each in after])) for axis, after in new.items() if after}
    if not left:
        return Name(None, (), 0.0)
    best = min(left, key=lambda axis: left[axis])
    sure = float(np.mean([SURE / max(each.before - usual * each.samples, SURE) for each in new[best]]))
    among = sorted((axis for axis in left if left[axis] <= max(LEAVES * left[best], sure) and left[axis] < 1 - NAMED),
                   key=lambda axis: left[axis])[:MOST_NAMES]  # fmt: skip
    nearest = tuple(among) or (best,)
    return Name(best if among else None, nearest, 1 - left[best])


def seems_two(usual: float, one: Explained, least: float) -> bool:
    """Whether the best suspect leaves so much of a session, `least` at least, that a second one may be there."""
    left = _left(one, usual)
    return left >= least and left * (one.before - usual * one.samples) > SURE


def pair_of(
    usual: float, one: Mapping[str, Explained], pairs: Mapping[Suspects, Explained], least: Mapping[str, float]
) -> Name | None:
    """The two suspects that explain a change together, where each takes the `least` beside the other at least, and
    nearly all that this leaves: `axis` is the one that explains more alone, `among` those that do as well as the other
    beside it. None where no pair explains PAIR, or others do as well in which that one is not."""
    left = {pair: _left(each, usual) for pair, each in pairs.items()}
    best = min(left, key=lambda pair: left[pair], default=None)
    if best is None or 1 - left[best] < PAIR:
        return None
    if any(_left(one[axis], usual) < max(left[best] + least[axis], OF_LEFT * left[best]) for axis in best):
        return None
    new = max(pairs[best].before - usual * pairs[best].samples, SURE)
    alike = [pair for pair in left if left[pair] <= max(LEAVES * left[best], SURE / new)]
    first = min(best, key=lambda axis: _left(one[axis], usual))
    if not all(first in pair for pair in alike):
        return None
    others = sorted(alike, key=lambda pair: left[pair])
    return Name(first, tuple(axis for pair in others for axis in pair if axis != first)[:MOST_NAMES], 1 - left[best])


def _left(each: Explained, usual: float) -> float:
    """The share of what is new that a suspect leaves, 0 to 1."""
    new = max(each.before - usual * each.samples, SURE)
    return float(np.clip((each.after - usual * each.samples) / new, 0.0, 1.0))
