"""Which effects could explain what is left of a sheet: each is tried at some strengths, without any refit.

What the rig's numbers could do as well is taken out by their slopes, and an effect counts with the strength that then
fits best: Rao's score test, as for recordings (see trace/score.py), about the numbers that the rig declares.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...plant.effects import Effect
from ..fit.determined import FreeParameter
from ..fit.free_parameters import Candidate, at_strength, extend_parameters, strengths
from ..fit.normal_equations import ranges
from .fit import Errors

_STRENGTHS = (0.1, 0.3, 1.0, 3.0)  # of typical
_STRONG, _WIDE = 10.0, 100.0  # tried too, where the range goes on to so many times typical
_SMALLEST, _LARGEST = 0.2, 5.0  # how far beyond a tried strength a fit may be started


@dataclass(frozen=True, eq=False)
class SheetScore:
    """An effect's share of the misfit and the numbers to start from; its change of the errors, of length 1."""

    candidate: Candidate
    share: float
    change: np.ndarray


class Rest:
    """What is left of errors or of their change when the rig's numbers follow, as one vector."""

    def __init__(self, free: Sequence[FreeParameter], slopes: np.ndarray) -> None:
        *_, width = ranges(free)
        self._numbers = len(free)
        columns = np.concatenate((slopes.reshape(-1, self._numbers), np.diag(1 / width)))
        self._basis = np.linalg.qr(columns)[0]

    def __call__(self, change: np.ndarray) -> np.ndarray:
        """The part of a change [points, 2] of the errors that no number of the fit explains."""
        whole = np.append(change.ravel(), np.zeros(self._numbers))
        return whole - self._basis @ (self._basis.T @ whole)


def scores(
    errors: Errors, x: np.ndarray, library: Sequence[Effect], report: Callable[[Effect], None]
) -> list[SheetScore]:
    """The scores of a library beside a model with numbers at distances x [free], best first."""
    here = errors.at(x[None])[0]
    rest = Rest(errors.free, errors.slopes(x, here))
    left = rest(here)
    ranked = []
    for effect in library:
        report(effect)
        ranked.append(_score(errors, x, effect, here, rest, left))
    return sorted(ranked, key=lambda score: -score.share)


def _score(
    errors: Errors,
    x: np.ndarray,
    effect: Effect,
    here: np.ndarray,
    rest: Rest,
    left: np.ndarray,
) -> SheetScore:
    """The best of an effect's trials; a trial that cannot be simulated says nothing."""
    problem = errors.problem
    model = problem.model((*errors.model.effects, effect))
    p = extend_parameters(errors.model.plant, errors.parameters(x[None])[0], model.plant)
    trials = _trials(effect)
    rows = np.array([model.plant.parameter_values(p, **_keys(effect, numbers)) for numbers in trials])
    changes = Errors(problem, model, (), p).of(rows) - here
    best = SheetScore(Candidate(effect, trials[0]), 0.0, np.zeros_like(left))
    two_sided = any(n.off is not None and n.low < n.off < n.high for n in effect.numbers)
    for numbers, change in zip(trials, changes, strict=True):
        shape = rest(change)
        size = float(shape @ shape)
        factor = -float(shape @ left) / size if size > 1e-9 else 0.0
        share = factor * factor * size / float(left @ left)
        if share > best.share and (factor > 0 or two_sided):
            factor = float(np.sign(factor) * np.clip(abs(factor), _SMALLEST, _LARGEST))
            best = SheetScore(Candidate(effect, _scaled(effect, numbers, factor)), share, shape / np.sqrt(size))
    return best


def _trials(effect: Effect) -> list[dict[str, float]]:
    """Some strengths of the whole effect, each of its strengths alone, and what shapes it where it is tried."""
    names = strengths(effect)
    wide = any(n.off == 0 and n.high >= _WIDE * n.typical > 0 for n in effect.fitted)
    trials = [at_strength(effect, strength) for strength in (*_STRENGTHS, *((_STRONG,) if wide else ()))]
    if len(names) > 1:
        trials += [at_strength(effect, 1.0, only) for only in names]
    shapes = [{number.name: value} for number in effect.numbers for value in number.tried]
    return trials + [at_strength(effect, _STRENGTHS[1]) | shape for shape in shapes]


def _scaled(effect: Effect, numbers: dict[str, float], factor: float) -> dict[str, float]:
    """Numbers with the strengths `factor` times as far from off, inside their ranges."""
    scaled = dict(numbers)
    for number in effect.fitted:
        if number.off is not None:
            value = number.off + factor * (numbers[number.name] - number.off)
            scaled[number.name] = float(np.clip(value, number.low, number.high))
    return scaled


def _keys(effect: Effect, numbers: dict[str, float]) -> dict[str, float]:
    return {effect.key(name): value for name, value in numbers.items()}
