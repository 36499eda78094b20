"""Described numbers that records contradict: what they say, with its interval, and how far that is from the trust."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.numbers import finite
from ...base.units import from_si
from ...plant.effects import Effect
from ...report import within
from ...report.table import shown
from ...rigs.number import Number
from ...rigs.rig import Rig
from ..fit.solver import Fit


@dataclass(frozen=True)
class WrongNumber:
    """A number of the rig file, and what the records say: value and 95 % interval [SI]."""

    number: Number
    value: float
    low: float
    high: float

    @property
    def beyond(self) -> float:
        """How far the interval is outside the range that the rig file trusts it to, over the width of that range."""
        low, high = self.number.low, self.number.high
        assert low is not None
        assert high is not None
        return max(self.low - high, low - self.high) / (high - low)

    @property
    def is_contradicted(self) -> bool:
        """Whether the interval is outside the range."""
        return self.beyond > 0

    def json(self) -> dict[str, Any]:
        """By the keys of trace.json, in the unit of the rig file."""
        number = self.number
        values = (number.value, self.value, self.low, self.high)
        found = [finite(from_si(value, number.unit, number.si)) for value in values]
        name = {"name": f"{number.name} [{number.unit}]"}
        return name | dict(zip(("described", "found", "low", "high"), found, strict=True))

    @property
    def text(self) -> str:
        """In words: described and found."""
        number = self.number
        found = (float(from_si(value, number.unit, number.si)) for value in (self.value, self.low, self.high))
        value, low, high = (shown(cell) for cell in within(*found))
        return (
            f"{number.name} is described as {number.shown:.4g} {number.unit}, and the records say {value}, "
            f"{low} to {high}, which is {self.beyond:.2g} times the width of its range outside that"
        )


def wrong_numbers(rig: Rig, fit: Fit, effects: Sequence[Effect]) -> list[WrongNumber]:
    """What a fit with candidates that shift numbers says of these; those that stay inside their ranges are left out."""
    shifted = (_wrong(rig, fit, effect) for effect in effects if effect.shifts)
    return [wrong for wrong in shifted if wrong.is_contradicted]


def corrected(rig: Rig, fit: Fit, effects: Sequence[Effect], source: str) -> dict[str, Number]:
    """The numbers that a fit shifted, by name, as a rig file has them: their ranges are what they are known within."""
    return {
        wrong.number.name: _number(wrong, source)
        for effect in effects
        if effect.shifts
        for wrong in [_wrong(rig, fit, effect)]
    }


def _wrong(rig: Rig, fit: Fit, effect: Effect) -> WrongNumber:
    number = rig.numbers[effect.shifts]
    names = [free.name for free in fit.free]
    columns = [names.index(name) for name in (number.name, effect.key(effect.numbers[0].name)) if name in names]
    value, slopes = 0.0, np.zeros(len(names))
    for column in columns:
        free = fit.free[column]
        at = float(np.clip(free.value(float(fit.x[column])), free.low, free.high))
        value, slopes[column] = value + at, at if free.scale is None else free.scale
    half = 1.96 * float(np.sqrt(slopes @ fit.covariance @ slopes))
    return WrongNumber(number, value, value - half, value + half)


def _number(wrong: WrongNumber, source: str) -> Number:
    number = wrong.number
    return replace(
        number,
        value=wrong.value,
        low=wrong.low,
        high=wrong.high,
        interval=(wrong.low, wrong.high),
        source=f"fitted to {source}, which contradicts {number.shown:.4g} {number.unit}; it was: {number.source}",
    )
