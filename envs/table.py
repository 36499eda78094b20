"""One table of a task file, read strictly: every complaint says which file and key, and what to write."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from workbench.base.errors import InputError, nearest
from workbench.base.toml import check_keys
from workbench.base.units import to_si

from .references import Range


class Table:
    """Asks for values by key; a missing, unknown or impossible one raises InputError."""

    def __init__(self, values: Mapping[str, Any], where: str, known: Iterable[str]) -> None:
        check_keys(values, known, where)
        self._values, self._where = values, where

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def table(self, key: str, *known: str) -> "Table":
        """A table inside this one, in which only the `known` keys are allowed."""
        part = self._get(key, f"add a table [{key}]")
        if not isinstance(part, Mapping):
            raise self.complaint(key, f"must be a table; write [{key}]")
        return Table(part, f"{self._where}: [{key}]", known)

    def text(self, key: str) -> str:
        """Words."""
        value = self._get(key, f'write {key} = "..."')
        if not isinstance(value, str):
            raise self.complaint(key, f'write {key} = "..."')
        return value

    def word(self, key: str, known: Iterable[str]) -> str:
        """A word out of a list."""
        value = self.text(key)
        if value not in known:
            raise self.complaint(key, f'no such thing as "{value}"; {nearest(value, known)}')
        return value

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self._get(key, f"write {key} = true or {key} = false")
        if not isinstance(value, bool):
            raise self.complaint(key, "must be true or false")
        return value

    def count(self, key: str) -> int:
        """A whole number, 1 or more."""
        value = self._get(key, f"write {key} = 1")
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise self.complaint(key, "must be a whole number, 1 or more")
        return value

    def weight(self, key: str) -> float:
        """A pure number, 0 or more."""
        value = self._get(key, f"write {key} = 1")
        if not _finite(value) or value < 0:
            raise self.complaint(key, "must be a number, 0 or more")
        return float(value)

    def quantity(self, key: str, number: str, si: str) -> float:
        """A positive number with its unit, in SI: `number` and `unit` of the table at `key`, which may hold more."""
        hint = f'write {{{number} = ..., unit = "{si}"}}'
        entry = self._get(key, hint)
        if not isinstance(entry, Mapping) or not _finite(entry.get(number)) or entry[number] <= 0:
            raise self.complaint(key, f"{number} must be a positive number; {hint}")
        return self._si(key, entry[number], entry, si)

    def number(self, key: str, si: str) -> float:
        """`{value, unit}`, positive, in SI."""
        value = self.quantity(key, "value", si)
        check_keys(self._values[key], ("value", "unit"), f"{self._where}: {key}")
        return value

    def range(self, key: str, si: str, least: float = -math.inf, above: float = -math.inf) -> Range:
        """`{low, high, unit}` in SI, `low` not below `least` and above `above`."""
        hint = f'write {{low = ..., high = ..., unit = "{si}"}}'
        entry = self._get(key, hint)
        if not isinstance(entry, Mapping) or not (_finite(entry.get("low")) and _finite(entry.get("high"))):
            raise self.complaint(key, hint)
        check_keys(entry, ("low", "high", "unit"), f"{self._where}: {key}")
        low, high = (self._si(key, entry[end], entry, si) for end in ("low", "high"))
        if not low <= high:
            raise self.complaint(key, "low must not be above high")
        if low < least or low <= above:
            raise self.complaint(key, f"low must be {'positive' if above == 0 else f'{least:g} or more'}")
        return Range(low, high)

    def complaint(self, key: str, what: str) -> InputError:
        """An error about a key of this table."""
        return InputError(f"{self._where}: {key}: {what}")

    def _get(self, key: str, hint: str) -> Any:
        if key not in self._values:
            raise InputError(f"{self._where}: {key} is missing; {hint}")
        return self._values[key]

    def _si(self, key: str, value: float, entry: Mapping[str, Any], si: str) -> float:
        unit = entry.get("unit")
        if not isinstance(unit, str):
            raise self.complaint(key, f'no unit; write unit = "{si}" or one that converts to it')
        try:
            return float(to_si(value, unit, si))
        except InputError as error:
            raise self.complaint(key, str(error)) from None


def _finite(value: Any) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
