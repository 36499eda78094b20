"""What a change is: the suspects are fitted to sessions before and after it, with the rig otherwise as it was.

To first order every axis is a line; a seal that leaks six times as much is none. So a change that was found to first
order is named by fits: one suspect at a time is free, the rig's own numbers may move as healthy rigs do, and what a
suspect explains of the sessions before the change does not count for it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...plant.effects import Effect
from ...rigs.number import Number
from ...rigs.rig import Rig
from ..fit.free_parameters import Candidate, at_strength
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel, fit_rig, refit
from ..trace.score import NuisanceProjection
from .changes import History, wander
from .session_evidence import sensor_changes

SUSPECTS = 7
ALIKE = 0.93  # of the best suspect's gain: others with so much explain the change as well
SURE = 30.0  # squared errors over sigma, that it has to be ahead at least
NAMED = 0.5  # of the change: a suspect that explains less is not its name
WEAR = 15.0  # a number may become so many times more or less
_START = 0.3  # of an effect's typical strength
Problem = Callable[[Rig], EstimationProblem]


@dataclass(frozen=True)
class Explained:
    """What a suspect makes of one session: the squared errors with the rig as it was, and with it; its value, SI or
    of an effect's typical strength, with the standard deviation; all numbers of the rig, those of the effect too."""

    before: float
    after: float
    value: float
    deviation: float
    numbers: Mapping[str, float]


def suspects(known: History, moves: np.ndarray) -> list[int]:
    """The axes [SUSPECTS] that explain most of the newest session to first order beyond the moves [n] of those before;
    those of the rig's numbers that are not meant wander as healthy ones do."""
    matrix, k = known.matrix[-1], known.numbers
    left = known.vector[-1] - matrix @ moves
    held = np.diag(1.0 / wander(known)[:k])
    own = np.linalg.solve(matrix[:k, :k] + held, np.column_stack((left[:k], matrix[:k])))
    usual = float(left[:k] @ own[:, 0])
    best = []
    for j in range(len(known.axes)):
        if j < k:
            free = held * (np.arange(k) != j)
            best.append(float(left[:k] @ np.linalg.solve(matrix[:k, :k] + free, left[:k])) - usual)
        else:
            size = left[j] - matrix[j, :k] @ own[:, 0]
            best.append(size**2 / max(matrix[j, j] - matrix[j, :k] @ own[:, 1 + j], 1e-12))
    return [int(j) for j in np.argsort(best)[::-1][:SUSPECTS]]


def explained(problem: Problem, rig: Rig, axes: Sequence[str], library: Sequence[Effect]) -> dict[str, Explained]:
    """Suspects, one at a time, on one session, whose problem is made for a rig that is held to what healthy ones do.

    Raises InputError where no fit is near.
    """
    own = problem(rig)
    was = fit_rig(own)
    formulas = {effect.name: effect for effect in reversed(library)}
    found = {}
    for axis in axes:
        if axis in rig.numbers:
            found[axis] = _number(problem, rig, axis, was)
        elif axis in formulas:
            found[axis] = _effect(own, was, formulas[axis])
        else:
            found[axis] = _sensor(own, was, axis)
    return found


def _number(problem: Problem, rig: Rig, name: str, was: FittedModel) -> Explained:
    free = fit_rig(problem(replace(rig, numbers={**rig.numbers, name: _worn(rig.numbers[name])})))
    index = [each.name for each in free.fit.free].index(name)
    low, high = free.fit.interval(index)
    numbers = _numbers(free)
    return Explained(
        float(was.fit.squares.sum()), float(free.fit.squares.sum()), numbers[name], (high - low) / 3.92, numbers
    )


def _worn(number: Number) -> Number:
    ends = sorted((number.value / WEAR, number.value * WEAR))
    return replace(number, low=ends[0], high=ends[1])


def _effect(problem: EstimationProblem, was: FittedModel, effect: Effect) -> Explained:
    found = refit(problem, was, Candidate(effect, at_strength(effect, _START)))
    numbers = _numbers(found)
    strong = next(n for n in effect.fitted if n.off is not None)
    reach = strong.typical - (strong.off or 0.0)
    index = [each.name for each in found.fit.free].index(effect.key(strong.name))
    low, high = found.fit.interval(index)
    value = (numbers[effect.key(strong.name)] - (strong.off or 0.0)) / reach
    squares = float(was.fit.squares.sum()), float(found.fit.squares.sum())
    return Explained(*squares, value, (high - low) / 3.92 / abs(reach), numbers)


def _sensor(problem: EstimationProblem, was: FittedModel, name: str) -> Explained:
    """To first order, which a sensor's scale and zero are exactly."""
    rest = NuisanceProjection(was.model, problem.train, was.fit)
    axis, change = next(
        each for each in sensor_changes(problem.train, problem.rig, rest.errors) if each[0].name == name
    )
    column, errors = rest(change), rest(rest.errors)
    size = float(column @ errors / max(column @ column, 1e-12))
    before = float(was.fit.squares.sum())
    deviation = float(np.sqrt(problem.kappa / max(column @ column, 1e-12)))
    scale = axis.scale
    return Explained(
        before, before - size * size * float(column @ column), -size * scale, deviation * scale, _numbers(was)
    )


def _numbers(fitted: FittedModel) -> dict[str, float]:
    return dict(zip(fitted.model.parameters, fitted.fit.p.tolist(), strict=False))


@dataclass(frozen=True)
class Name:
    """Who explains the change: the best suspect, None where none explains NAMED of it; those that do as well; and the
    share of the change that the best explains."""

    axis: str | None
    among: tuple[str, ...]
    share: float


def name_of(old: Mapping[str, Explained], new: Mapping[str, Sequence[Explained]]) -> Name:
    """The name of a change, of every suspect on a session before it and on some after it."""
    gained = {
        axis: sum(each.before - each.after for each in after)
        - len(after) * max(old[axis].before - old[axis].after, 0.0)
        for axis, after in new.items() if axis in old
    }  # fmt: skip
    if not gained:
        return Name(None, (), 0.0)
    best = max(gained, key=lambda axis: gained[axis])
    least = min(ALIKE * gained[best], gained[best] - SURE)
    among = sorted((axis for axis in gained if gained[axis] >= least), key=lambda axis: -gained[axis])
    changed = sum(each.before for each in new[best]) - len(new[best]) * old[best].before
    share = gained[best] / changed if changed > 0 else 0.0
    return Name(best if share >= NAMED else None, tuple(among), share)
