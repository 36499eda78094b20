"""What a fit found: numbers with intervals in the units that people read, and the rig file with them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.numbers import finite
from ...base.units import from_si
from ...base.words import listed
from ...plant.effects import Effect, EffectNumber, numbers_of
from ...plant.effects.declared import effect_use
from ...report import within
from ...report.digits import four_digits
from ...report.table import Cell, shown
from ...rigs.number import Number
from ...rigs.rig import EffectUse, Rig
from ...rigs.tolerances import is_pinned
from ..fit.determined import FreeParameter
from ..fit.solver import UNSEEN, Fit
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel
from .session_fit import numbers_in_sessions, session_fits
from .untold import without_untold
from .wrong_numbers import corrected

Interval = list[float | None]


@dataclass(frozen=True)
class Fitted:
    """A number of the rig after a fit, SI: where it was, where it is, its 95 % interval, whether it is at an end, and
    whether the records leave it anywhere in its declared range."""

    number: Number
    value: float
    low: float
    high: float
    at_bounds: bool
    unseen: bool

    @property
    def pushed(self) -> bool:
        """Whether it went to an end of its range at which it was not declared: evidence that something is missing."""
        return self.at_bounds and abs(self.value - self.number.value) > 1e-6 * (self._high - self._low)

    @property
    def _low(self) -> float:
        return -np.inf if self.number.low is None else self.number.low

    @property
    def _high(self) -> float:
        return np.inf if self.number.high is None else self.number.high


def fitted(rig: Rig, fit: Fit) -> list[Fitted]:
    """The rig's own numbers that a fit moved, those of the effects that it declares included."""
    numbers = numbers_of(rig)
    return [
        Fitted(
            numbers[free.name],
            _value(fit, index),
            *fit.interval(index),
            free.name in fit.at_bounds,
            fit.leaves_open(index),
        )
        for index, free in _own(rig, fit)
    ]


def pinned(rig: Rig) -> list[str]:
    """Names of the rig's numbers that no datasheet tells exactly, and that no fit moves for want of bounds."""
    return [number.name for number in rig.numbers.values() if is_pinned(number)]


def pinned_sentence(rig: Rig) -> str:
    """The pinned numbers in a sentence, to stand beside what went to an end of its range; empty where none is
    pinned."""
    names = pinned(rig)
    pins = (
        "is pinned: without bounds no fit moves it"
        if len(names) == 1
        else "are pinned: without bounds no fit moves them"
    )
    return f" {listed(names)} {pins}." if names else ""


def _own(rig: Rig, fit: Fit) -> list[tuple[int, FreeParameter]]:
    """The rig's own among the numbers that a fit moved, with their places."""
    numbers = numbers_of(rig)
    return [(index, free) for index, free in enumerate(fit.free) if free.name in numbers]


def unbounded(rig: Rig, fit: Fit) -> dict[str, tuple[float, float, float]]:
    """Value and 95 % interval, SI, of the rig's own numbers by name, beyond their ranges where records leave that
    open."""
    found = {}
    for entry, (index, free) in zip(fitted(rig, fit), _own(rig, fit), strict=True):
        half = 1.96 * float(np.sqrt(fit.covariance[index, index]))
        ends = sorted(float(free.value(fit.x[index] + side * half)) for side in (-1.0, 1.0))
        found[entry.number.name] = (entry.value, ends[0], ends[1])
    return found


def fitted_cells(entry: Fitted) -> list[Cell]:
    """Value, low and high in the unit of the rig file, to the digits that the interval tells."""
    number = entry.number
    values = (float(from_si(v, number.unit, number.si)) for v in (entry.value, entry.low, entry.high))
    return interval_cells([finite(value) for value in values])


def interval_cells(interval: Interval) -> list[Cell]:
    """Value, low and high to the digits that they tell; a dash for what does not exist."""
    value, low, high = interval
    if value is None or low is None or high is None:
        return list(interval)
    return list(within(value, low, high))


def base_intervals(rig: Rig, fit: Fit) -> dict[str, Interval]:
    """{"beta [Pa]": [value, low, high]}, 95 %, of the rig's own numbers, SI."""
    return {
        f"{entry.number.name} [{entry.number.si}]": [finite(v) for v in (entry.value, entry.low, entry.high)]
        for entry in fitted(rig, fit)
    }


def effect_intervals(effect: Effect, fit: Fit) -> dict[str, Interval]:
    """{"Fc [N]": [value, low, high]}, 95 %, of an effect's numbers, each in the unit that people read.

    A number that is given has no interval.
    """
    names = [free.name for free in fit.free]
    intervals = {}
    for number in effect.numbers:
        values: tuple[float, float, float] = (number.typical, np.nan, np.nan)
        if not number.given:
            index = names.index(effect.key(number.name))
            values = (_value(fit, index), *fit.interval(index))
        intervals[f"{number.name} [{number.shown}]"] = [finite(from_si(v, number.shown, number.si)) for v in values]
    return intervals


def effect_numbers(effect: Effect, fit: Fit) -> dict[str, float]:
    """An effect's numbers as fitted, SI by name; one that is given is typical."""
    names = [free.name for free in fit.free]
    return {n.name: n.typical if n.given else _value(fit, names.index(effect.key(n.name))) for n in effect.numbers}


def effect_covariance(effect: Effect, fit: Fit) -> np.ndarray:
    """Covariance [numbers, numbers] SI of an effect's numbers, in their order; 0 for those that are given."""
    names = [free.name for free in fit.free]
    change = np.zeros((len(effect.numbers), len(names)))
    for row, number in enumerate(effect.numbers):
        if not number.given:
            index = names.index(effect.key(number.name))
            free = fit.free[index]
            change[row, index] = _value(fit, index) if free.scale is None else free.scale
    return change @ fit.covariance @ change.T


def number_remarks(effect: Effect, fit: Fit) -> dict[str, list[str]]:
    """What is to be thought of an effect's fitted numbers, by name: nothing where they are told, and physical."""
    strange = not_physical(effect, fit)
    return {
        n.name: ["at an end"] * (effect.key(n.name) in fit.at_bounds)
        + _doubts(n, effect.key(n.name), fit)
        + [f"below {n.at_least}, not physical"] * (n.name in strange)
        for n in effect.fitted
    }


def not_physical(effect: Effect, fit: Fit) -> list[str]:
    """The fitted numbers of an effect that are below another one that physics does not put them below."""
    limited = [number for number in effect.numbers if number.at_least]
    values = effect_numbers(effect, fit) if limited else {}
    return [n.name for n in limited if values[n.name] < values[n.at_least]]


def _doubts(number: EffectNumber, name: str, fit: Fit) -> list[str]:
    """What a 95 % interval leaves open: almost the whole range (see UNSEEN), or whether the number does anything."""
    index = [free.name for free in fit.free].index(name)
    (low, high), free = fit.interval(index), fit.free[index]
    if not free.normalised(high) - free.normalised(low) < UNSEEN * 2 * free.width:
        return ["not told"]
    return ["may be none"] if number.off is not None and low <= number.off <= high else []


def correlations(fit: Fit) -> np.ndarray:
    """Correlations of the fitted numbers [k, k]."""
    size = np.sqrt(np.diag(fit.covariance))
    return fit.covariance / np.outer(size, size)


def fitted_rig(problem: EstimationProblem, model_fit: FittedModel, files: Sequence[str] = ()) -> Rig:
    """The rig with the numbers of a fit, also in sessions, and the effects that were added; `files` have effects beside
    the library's. What the records of a closed loop do not tell stays as it was (see untold.py)."""
    name = problem.campaign.path.resolve().name
    sessions = numbers_in_sessions(problem.rig.sessions, session_fits(problem, model_fit.fit), name)
    fit, untold = without_untold(problem, model_fit)
    return replace(rig_as_fitted(problem.rig, name, fit, model_fit.effects, files, untold), sessions=sessions)


def rig_as_fitted(
    rig: Rig, source: str, fit: Fit, effects: Sequence[Effect], files: Sequence[str] = (), untold: Sequence[str] = ()
) -> Rig:
    """The rig with the numbers of a fit to `source`, and with effects whose numbers it has too; those that are `untold`
    stay as they were."""
    numbers = {entry.number.name: _as_fitted(entry, source, untold) for entry in fitted(rig, fit)}
    numbers |= corrected(rig, fit, effects, source)
    uses = tuple(_use(effect, fit, f"fitted to {source}") for effect in effects if not effect.shifts)
    return replace(
        rig,
        name=f"{rig.name}-{source}",
        numbers={key: numbers.get(key, number) for key, number in rig.numbers.items()},
        effects=(*(_refitted(use, numbers) for use in rig.effects), *uses),
        effect_files=tuple(dict.fromkeys((*rig.effect_files, *files))),
    )


def _value(fit: Fit, index: int) -> float:
    free = fit.free[index]
    return min(max(free.value(float(fit.x[index])), free.low), free.high)


def _as_fitted(entry: Fitted, campaign: str, untold: Sequence[str]) -> Number:
    """The number with its fitted value, its interval and where they come from; as it was, where it is untold."""
    if entry.number.name in untold:
        return replace(entry.number, source=f"{campaign} does not tell it; {entry.number.source}")
    end = ", at an end of its range" if entry.at_bounds else ""
    end += f", told only with {listed(untold)} held" if entry.unseen and untold else ""
    _, low, high = (shown(cell) for cell in fitted_cells(entry))
    source = f"fitted to {campaign}: 95 % from {low} to {high}{end}; it was {four_digits(entry.number.shown)}"
    return replace(entry.number, value=entry.value, source=source, interval=(entry.low, entry.high))


def _refitted(use: EffectUse, numbers: Mapping[str, Number]) -> EffectUse:
    """A declared effect with those of its numbers that were fitted."""
    changed = {name: numbers.get(f"{use.name}.{name}", number) for name, number in use.numbers.items()}
    return replace(use, numbers={name: replace(number, name=name) for name, number in changed.items()})


def _use(effect: Effect, fit: Fit, source: str) -> EffectUse:
    """The effect with its fitted numbers, which a later fit may move within the effect's ranges."""
    use, index = effect_use(effect, effect_numbers(effect, fit), source), [free.name for free in fit.free].index
    ranges = {n.name: (n.low, n.high, fit.interval(index(effect.key(n.name)))) for n in effect.fitted}
    numbers = {name: _ranged(number, *ranges[name]) for name, number in use.numbers.items() if name in ranges}
    return replace(use, numbers={**use.numbers, **numbers})


def _ranged(number: Number, low: float, high: float, interval: tuple[float, float]) -> Number:
    ends = min(interval[0], number.value), max(interval[1], number.value)
    return replace(number, low=low, high=high, interval=ends)
