"""A table of a TOML document, read strictly: a complaint names file, line and key, and says what to write."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from .errors import InputError, clipped, echo, nearest
from .files import name_problem
from .key_lines import KeyPath
from .units import Spec, quantity, to_si

T = TypeVar("T")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]{1,80}")
_LOWEST = -math.inf


@dataclass(frozen=True)
class TableLocation:
    """A table's place in a document: `document` opens every message, `lines` knows the lines of key paths."""

    document: str
    path: KeyPath = ()
    lines: Callable[[], Mapping[KeyPath, int]] = dict

    def inside(self, *path: str | int) -> "TableLocation":
        """The place of a key or an entry in here."""
        return TableLocation(self.document, self.path + path, self.lines)

    def __str__(self) -> str:
        """ "file: line N: table.key"; the line is that of the nearest table where the key itself is not written."""
        parts = [self.document]
        lines = self.lines()
        for end in range(len(self.path), 0, -1):
            if self.path[:end] in lines:
                parts.append(f"line {lines[self.path[:end]]}")
                break
        if self.path:
            parts.append(".".join(map(_shown, self.path)))
        return ": ".join(parts)


class ConfigTable:
    """Gives values by key. A missing, unknown or impossible one raises InputError.

    A method with a `default` returns it for a key that is not there; without one the key must be there.
    """

    def __init__(self, values: Mapping[str, Any], place: TableLocation | str, *known: str) -> None:
        self.values = values
        self.place = TableLocation(place) if isinstance(place, str) else place
        if known:
            self.allow(*known)

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def __iter__(self) -> Iterator[str]:
        return iter(self.values)

    def __len__(self) -> int:
        return len(self.values)

    def allow(self, *known: str) -> "ConfigTable":
        """This table; raises InputError for a key that is not `known`, naming the nearest one."""
        for key in self.values:
            if key not in known:
                raise self.complaint(key, f"unknown key; {nearest(key[:80], known)}")
        return self

    def replaced(self, values: Mapping[str, Any]) -> "ConfigTable":
        """Other values in the same place."""
        return ConfigTable(values, self.place)

    def complaint(self, key: str, what: str) -> InputError:
        """An error about a key of this table."""
        return InputError(f"{self.place.inside(key)}: {what}")

    def named(self, name: str) -> str:
        """The name of this table, by which results are stored. Raises InputError for one that no file can have."""
        if problem := name_problem(name):
            raise self.error(problem)
        return name

    def error(self, what: str) -> InputError:
        """An error about this table."""
        return InputError(f"{self.place}: {what}")

    def about(self, key: str, make: Callable[[], T]) -> T:
        """What `make` returns; an InputError of it becomes one about this key."""
        try:
            return make()
        except InputError as error:
            raise self.complaint(key, str(error)) from None

    def table(self, key: str, *known: str) -> "ConfigTable":
        """A table in here, in which only the `known` keys are allowed, where any are named."""
        header = ".".join(_shown(part) for part in self.place.inside(key).path if isinstance(part, str))
        return self._as_table(self._get(key, f"add a table [{header}]"), key, f"write [{header}]", *known)

    def optional_table(self, key: str, *known: str) -> "ConfigTable":
        """The table of a key, empty where it is not there."""
        return self.table(key, *known) if key in self else ConfigTable({}, self.place.inside(key))

    def tables(self, key: str, *known: str) -> list["ConfigTable"]:
        """A list of tables, empty where it is not there."""
        entries = self.values.get(key, [])
        if not isinstance(entries, list) or not all(isinstance(entry, Mapping) for entry in entries):
            header = ".".join(str(part) for part in self.place.inside(key).path if isinstance(part, str))
            raise self.complaint(key, f"must be a list of tables; write [[{header}]]")
        return [ConfigTable(entry, self.place.inside(key, i), *known) for i, entry in enumerate(entries)]

    def text(self, key: str, default: str | None = None) -> str:
        """Words; where they are needed, not empty."""
        value = self._get(key, f'write {key} = "..."', default)
        if not isinstance(value, str) or not (value or default is not None):
            raise self._misfit(key, f'write {key} = "..."')
        return value

    def word(self, key: str, known: Iterable[str], default: str | None = None) -> str:
        """A word out of a list."""
        words = list(known)
        hint = f"write one of {', '.join(words)}"
        value = self._get(key, hint, default)
        if not isinstance(value, str):
            raise self._misfit(key, hint)
        if value not in words:
            raise self._misfit(key, nearest(value[:80], words))
        return value

    def words(self, key: str, example: str, default: tuple[str, ...] | None = None) -> tuple[str, ...]:
        """A list of different texts, one or more."""
        hint = f'write {key} = ["{example}"]'
        if key not in self and default is not None:
            return default
        values = self._get(key, hint)
        if not isinstance(values, list) or not values or not all(isinstance(value, str) for value in values):
            raise self._misfit(key, f"must be a list of names; {hint}")
        for i, value in enumerate(values):
            if value in values[:i]:
                raise self.complaint(key, f"{echo(value)} is listed twice; remove one")
        return tuple(values)

    def flag(self, key: str, default: bool | None = None) -> bool:
        """True or false."""
        value = self._get(key, f"write {key} = true or {key} = false", default)
        if not isinstance(value, bool):
            raise self._misfit(key, "must be true or false")
        return value

    def count(self, key: str, least: int = 1, most: int = 10**18 - 1) -> int:
        """A whole number from `least` to `most`."""
        value = self._get(key, f"write {key} = {max(least, 1)}")
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            limits = f"{least} or more" if most >= 10**17 else f"from {least} to {most}"
            raise self._misfit(key, f"must be a whole number, {limits}")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number."""
        value = self._get(key, f"write {key} = 1.0", default)
        if not _finite(value):
            raise self._misfit(key, "must be a finite number")
        return float(value)

    def weight(self, key: str) -> float:
        """A number, 0 or more."""
        value = self._get(key, f"write {key} = 1")
        if not _finite(value) or value < 0:
            raise self._misfit(key, "must be a number, 0 or more")
        return float(value)

    def positive(self, key: str, unit: str = "") -> float:
        """A number above 0; the message says in which unit it is."""
        value = self._get(key, f"write {key} = 1.0{unit and f', in {unit}'}")
        if not _finite(value) or value <= 0:
            raise self._misfit(key, f"must be a positive number{unit and f', in {unit}'}")
        return float(value)

    def numbers(self, key: str, example: str) -> tuple[float, ...]:
        """A list of finite numbers, one or more."""
        hint = f"write {key} = {example}"
        values = self._get(key, hint)
        if not isinstance(values, list) or not values or not all(map(_finite, values)):
            raise self._misfit(key, f"must be a list of numbers; {hint}")
        return tuple(map(float, values))

    def measure(self, key: str, si: str) -> float:
        """A number of this table in the unit that its key `unit` names, in the unit `si`."""
        return self._in_si(key, self.number(key), si)

    def quantity(self, key: str, spec: Spec, *also: str) -> float:
        """`{value, unit}` or text such as "10 mm", in SI and in its range; `also` are further keys that it may have."""
        hint = f'write {{value = ..., unit = "{spec.unit}"}}'
        meaning = f"{spec.meaning}, in {spec.unit}" if spec.meaning else f"in {spec.unit}"
        entry = self._get(key, hint, None, f"missing ({meaning})")
        if isinstance(entry, str):
            si = self.about(key, lambda: quantity(entry, spec.unit))
        else:
            si = self._as_table(entry, key, hint, "value", "unit", *also).measure("value", spec.unit)
        if problem := spec.problem(si):
            raise self.complaint(key, problem)
        return si

    def range(self, key: str, si: str, least: float = _LOWEST, above: float = _LOWEST) -> tuple[float, float]:
        """`{low, high, unit}` in SI, `low` not below `least` and above `above`."""
        hint = f'write {{low = ..., high = ..., unit = "{si}"}}'
        part = self._as_table(self._get(key, hint), key, hint, "low", "high", "unit")
        low, high = part.measure("low", si), part.measure("high", si)
        if not low <= high:
            raise self.complaint(key, "low must not be above high")
        if low < least or low <= above:
            raise self.complaint(key, f"low must be {'positive' if above == 0 else f'{least:g} or more'}")
        return low, high

    def path(self, key: str, beside: Path, suffix: str) -> Path:
        """The full path of a file that is there, relative to the folder `beside`; its name ends in `suffix`."""
        name = self.text(key)
        path = (beside / name).resolve()
        if path.suffix != suffix or not path.is_file():
            raise self.complaint(key, f"no such file as {clipped(name)} beside {self.place.document}; check the path")
        return path

    def _get(self, key: str, hint: str, default: Any = None, missing: str = "missing") -> Any:
        if key not in self.values and default is None:
            raise self.complaint(key, f"{missing}; {hint}")
        return self.values.get(key, default)

    def _as_table(self, value: Any, key: str, hint: str, *known: str) -> "ConfigTable":
        if not isinstance(value, Mapping):
            raise self._misfit(key, f"must be a table; {hint}")
        return ConfigTable(value, self.place.inside(key), *known)

    def _in_si(self, key: str, value: float, si: str) -> float:
        if not isinstance(self.values.get("unit"), str):
            raise self.complaint("unit", f'no unit; write unit = "{si}" or one that converts to it')
        converted = self.about("unit", lambda: float(to_si(value, self.values["unit"], si)))
        if not math.isfinite(converted):
            raise self._misfit(key, f"too large in {si}")
        return converted

    def _misfit(self, key: str, what: str) -> InputError:
        return InputError(f"{self.place.inside(key)} = {echo(self.values.get(key))}: {what}")


def _finite(value: Any) -> bool:
    try:
        return not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
    except OverflowError:  # a whole number beyond the floats
        return False


def _shown(part: str | int) -> str:
    """A part of a key path as TOML writes it; list entries count from 1."""
    if isinstance(part, int):
        return str(part + 1)
    return part if _BARE_KEY.fullmatch(part) else echo(part)
