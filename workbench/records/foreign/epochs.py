"""Clocks that count since 1970, as ROS and loggers write them, as seconds since their first row.

1.76e18 ns is a number to whole 256 ns only once it is a double; counted from the first row nothing more is lost.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import chain

import numpy as np

from .source import Heading, Source
from .unit_names import name_of

_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_EPOCH = (3e8, 4e9)  # s since 1970: from 1979 to 2096
_CLOCK = re.compile(r"(?:.*[^a-z])?(?:t|time|(?:time[ _]?)?stamp|epoch|unix[ _]?time|zeitstempel|horodatage)", re.I)
_SECONDS = re.compile(r"(?P<stem>.+?)[._ /]*(?:secs?|seconds|s)", re.I)
_NANOSECONDS = re.compile(r"(?P<stem>.+?)[._ /]*(?:nano_?secs?|nsecs?|nanoseconds|ns)", re.I)


@dataclass(frozen=True)
class _Clock:
    """Columns that together are a clock, what one of each is in s, and the value of each in the first row."""

    columns: tuple[int, ...]
    units: tuple[float, ...]
    first: tuple[float, ...]
    name: str

    def seconds(self, block: Sequence[np.ndarray]) -> np.ndarray:
        """Since the first row, [rows]."""
        parts = zip(self.columns, self.units, self.first, strict=True)
        return np.sum([(np.asarray(block[place]) - first) * unit for place, unit, first in parts], axis=0)

    def without(self, columns: Sequence[object], seconds: object) -> list[object]:
        """Columns with the clock in the place of its first one."""
        later = self.columns[1:]
        return [seconds if k == self.columns[0] else each for k, each in enumerate(columns) if k not in later]


def since_first_row(source: Source) -> Source:
    """The source, its clock in s since the first row where it counts since 1970; other sources as they are."""
    first = next(source.blocks, None)
    if first is None:
        return source
    blocks = chain([first], source.blocks)
    clock = _clock(source.headings, first)
    if clock is None:
        return replace(source, blocks=blocks)
    began = datetime.fromtimestamp(sum(a * b for a, b in zip(clock.units, clock.first, strict=True)), UTC)
    was = " and ".join(f'"{source.headings[k].cell}"' for k in clock.columns)
    source.notes.append(f"{was} count since 1970: taken as seconds since the first row, {began:%Y-%m-%d %H:%M:%S} UTC")
    headings = clock.without(source.headings, Heading(f"{clock.name} [s]", "s"))
    return replace(source, headings=tuple(headings), blocks=_counted(clock, blocks))  # pyright: ignore[reportArgumentType]


def _counted(clock: _Clock, blocks: Iterator[Sequence[np.ndarray]]) -> Iterator[Sequence[np.ndarray]]:
    for block in blocks:
        yield clock.without(block, clock.seconds(block))  # pyright: ignore[reportReturnType]


def _clock(headings: Sequence[Heading], block: Sequence[np.ndarray]) -> _Clock | None:
    """The first column, or pair of columns, that is such a clock."""
    for place, heading in enumerate(headings):
        name, values = name_of(heading.cell), np.asarray(block[place])
        if not values.size or not np.isfinite(values[0]):
            continue
        for unit, size in _UNITS.items():
            if not (_EPOCH[0] <= values[0] * size <= _EPOCH[1] and heading.unit in (None, unit, "1")):
                continue
            if unit == "s" and (other := _nanoseconds(headings, name)) is not None:
                stem = _stem(_SECONDS, name)
                return _Clock((place, other), (1.0, 1e-9), (float(values[0]), float(block[other][0])), stem)
            if _CLOCK.fullmatch(name) and bool(np.all(np.diff(values[np.isfinite(values)]) > 0)):
                return _Clock((place,), (size,), (float(values[0]),), name)
    return None


def _nanoseconds(headings: Sequence[Heading], seconds: str) -> int | None:
    """The column of what is beyond the whole seconds of another."""
    stem = _stem(_SECONDS, seconds)
    cells = [heading.cell for heading in headings]
    return next((k for k, cell in enumerate(cells) if stem and _stem(_NANOSECONDS, cell) == stem), None)


def _stem(pattern: re.Pattern[str], name: str) -> str:
    match = pattern.fullmatch(name)
    return match["stem"].rstrip("._ /") if match else ""
