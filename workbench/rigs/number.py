"""A number of a rig with its unit, source, range and interval: as a value, and as the table of a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base.table import ConfigTable
from ..base.units import Spec, from_si, to_si


@dataclass(frozen=True)
class Number:
    """A number with its SI value, the unit it was written in, where it comes from, its declared range [SI], and the
    interval [SI] in which a fit knows it."""

    name: str
    value: float
    unit: str
    si: str
    source: str
    low: float | None = None
    high: float | None = None
    interval: tuple[float, float] | None = None

    @property
    def uncertain(self) -> tuple[float, float] | None:
        """Between what it lies, SI: the interval of a fit, or else the declared range."""
        if self.interval is not None or self.low is None or self.high is None:
            return self.interval
        return self.low, self.high

    @property
    def shown(self) -> float:
        """The value in the unit it was written in."""
        return float(from_si(self.value, self.unit, self.si))


def read_number(table: ConfigTable, name: str, spec: Spec, source: str = "") -> Number:
    """One `{value, unit, source, bounds}` of a table; `source` is where it comes from if it does not say."""
    if not isinstance(table.values.get(name), Mapping | None):
        raise table.complaint(name, f'write {{value = ..., unit = "{spec.unit}", source = "..."}}')
    value = table.quantity(name, spec, "source", "bounds", "interval")
    entry = table.table(name)
    low, high = _ends(entry, "bounds", value, spec.unit) if "bounds" in entry else (None, None)
    interval = _ends(entry, "interval", value, spec.unit) if "interval" in entry else None
    return Number(name, value, entry.text("unit", ""), spec.unit, entry.text("source", source), low, high, interval)


def _ends(entry: ConfigTable, key: str, value: float, si: str) -> tuple[float, float]:
    ends = entry.numbers(key, "[low, high]")
    if len(ends) != 2:
        raise entry.complaint(key, "must be two numbers, [low, high], in the number's unit")
    low, high = (float(to_si(end, entry.text("unit", ""), si)) for end in ends)
    if not low <= value <= high:
        raise entry.complaint(key, f"the value is outside its own {key}")
    return low, high


def number_entry(number: Number) -> dict[str, Any]:
    def shown(value: float) -> float:
        return shortest(value, number.unit, number.si)

    entry: dict[str, Any] = {"value": shown(number.value), "unit": number.unit}
    if number.source:
        entry["source"] = number.source
    if number.low is not None and number.high is not None:
        entry["bounds"] = [shown(number.low), shown(number.high)]
    if number.interval is not None:
        entry["interval"] = [shown(end) for end in number.interval]
    return entry


def shortest(value: float, unit: str, si: str) -> float:
    """A value [SI] in a unit with 14 digits, or as few more as give it back to the last bit, where any do."""
    written = float(from_si(value, unit, si))
    texts = [float(f"{written:.{digits}g}") for digits in (14, 15, 16)]
    return next((text for text in texts if float(to_si(text, unit, si)) == value), written)
