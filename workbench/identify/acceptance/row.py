"""A line of a sheet that a laboratory signs, and the limits that it passes or fails by."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit

from ...base.errors import InputError, nearest
from ...base.table import ConfigTable
from ...base.toml import read_toml

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Row:
    """A figure with its 95 % interval in `unit`. `reason` says why there is none, `maker` what the maker states.

    `limited`: whether a limit was given; `passed`: None where none was, or no figure was found. A figure whose interval
    reaches over a limit does not pass: what has not been shown to hold is not signed (the guard band of ISO 14253-1, in
    its sense).
    """

    id: str
    meaning: str
    unit: str
    value: float | None = None
    low: float | None = None
    high: float | None = None
    reason: str = ""
    maker: float | str | None = None
    passed: bool | None = None
    limited: bool = False

    def table(self) -> dict[str, Any]:
        """The row as metrics.json has it."""
        figures = {"id": self.id, "value": self.value, "unit": self.unit, "low": self.low, "high": self.high}
        return figures | {"maker": self.maker, "pass": self.passed, "reason": self.reason or None}


@dataclass(frozen=True)
class Estimate:
    """A value, its standard deviation, and the degrees of freedom by which that is known."""

    value: float
    deviation: float
    freedom: float = np.inf

    def interval(self, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """By Student's t."""
        reach = float(stdtrit(self.freedom, 0.5 + confidence / 2)) * self.deviation
        return self.value - reach, self.value + reach


def measured(id: str, meaning: str, unit: str, estimate: Estimate, scale: float = 1.0, positive: bool = False) -> Row:
    """A line of an estimate [SI] times `scale` in `unit`.

    One that is `positive` by its meaning has no part below 0; what an estimate falls below 0 is an error that the
    interval reaches up by.
    """
    value = scale * estimate.value
    low, high = sorted(scale * end for end in estimate.interval())
    if positive:
        value, low, high = max(0.0, value), max(0.0, low), max(high, abs(value))
    return Row(id, meaning, unit, value, low, high)


def unsaid(id: str, meaning: str, unit: str, reason: str) -> Row:
    """A line that these records cannot fill, and why."""
    return Row(id, meaning, unit, reason=reason)


@dataclass(frozen=True)
class AcceptanceLimit:
    """What the maker states, and the limits that the user sets, each in the unit of the line; None: no limit."""

    maker: float | str | None = None
    low: float | None = None
    high: float | None = None

    def judged(self, row: Row) -> Row:
        """The row with the maker's figure, and whether its whole interval lies within the limits."""
        limited = self.low is not None or self.high is not None
        if row.value is None or row.low is None or row.high is None or not limited:
            return replace(row, maker=self.maker, limited=limited)
        within = (self.low is None or row.low >= self.low) and (self.high is None or row.high <= self.high)
        return replace(row, maker=self.maker, passed=within, limited=True)


def read_limits(path: str | Path) -> dict[str, AcceptanceLimit]:
    """Limits by line, from a TOML of tables `[id]` with `maker`, `low` and `high`. Raises InputError."""
    top = read_toml(Path(path))
    return {name: _limit(top.table(name, "maker", "low", "high")) for name in top}


def _limit(table: ConfigTable) -> AcceptanceLimit:
    maker = table.values.get("maker")
    if isinstance(maker, bool) or not isinstance(maker, str | int | float | None):
        raise table.complaint("maker", "write a number in the line's unit, or words in quotes")
    low, high = (table.number(key) if key in table else None for key in ("low", "high"))
    if low is not None and high is not None and low > high:
        raise table.complaint("low", f"{low:g} is above high, {high:g}; swap them")
    return AcceptanceLimit(maker, low, high)


def judged(rows: Iterable[Row], limits: Mapping[str, AcceptanceLimit]) -> list[Row]:
    """The rows held against the limits: of a line, or of all lines whose names begin with a limit's.

    Raises InputError for a limit of a line that the sheet does not have.
    """
    rows = list(rows)
    for name in limits:
        if not any(_is_of(name, row) for row in rows):
            raise InputError(f"limits: the sheet has no line {name}; {nearest(name, [row.id for row in rows])}")
    own = [max((name for name in limits if _is_of(name, row)), key=len, default=None) for row in rows]
    return [row if name is None else limits[name].judged(row) for name, row in zip(own, rows, strict=True)]


def _is_of(name: str, row: Row) -> bool:
    return row.id == name or row.id.startswith(f"{name}_")
