"""The clock of a foreign file, in stamps or counts, as seconds since its first row.

A reader hands over text cells [object], dates and durations of a library [datetime64, timedelta64] and numbers as they
are. One origin holds for the whole file, in integer nanoseconds; the order of day and month is decided once, by what
lets the clock go on without a jump.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from .dated import Block, Dated
from .source import Heading, Source, unique_headings
from .stamps import NOTHING, SECOND, Count, count_of, counted, stamp_of
from .unit_names import name_of

_CLOCK = re.compile(
    r"t|.*(?:time|stamp|epoch|clock|date|datum|zeit|uhr|temps|horodat|heure|utc|ticks).*", re.IGNORECASE | re.DOTALL
)
_SECONDS = re.compile(r"(?P<stem>.+?)[._ /]*(?:secs?|seconds|s)", re.I)
_NANOSECONDS = re.compile(r"(?P<stem>.+?)[._ /]*(?:nano_?secs?|nsecs?|nanoseconds|ns)", re.I)
_MILLISECONDS = re.compile(r"ms|msecs?|milli\w*", re.I)
_LOOKED = 1000  # cells that tell what a column of text holds


@dataclass(frozen=True)
class _Clock:
    """Columns that together are a clock, what it is called then, ns since the first row [rows] of a block, and, when a
    block was read, those of the first row since 1970, where its date is told."""

    columns: tuple[int, ...]
    heading: Heading
    ns: Callable[[Block], np.ndarray]
    start: Callable[[], int | None]


def since_first_row(source: Source) -> Source:
    """The source with its clock in s since the first row, where that is told by stamps or counts; all else in numbers.

    Its blocks raise InputError for dates that are in no one order.
    """
    first = next(source.blocks, None)
    if first is None:
        return source
    clock = _clock(source.headings, first, source.notes)
    text = {k for k, values in enumerate(first) if values.dtype.kind in "OMm"}
    text -= {k for k in text if first[k].dtype.kind == "O" and _are_long(first[k])}
    taken = clock.columns if clock else ()
    if others := [source.headings[k].cell for k in sorted(text - set(taken))]:
        source.notes.append(f"left out, beside the clock: {', '.join(others)}")
    kept = [k for k in range(len(first)) if k in taken[:1] or k not in text | set(taken)]
    headings = [clock.heading if clock and k in taken else source.headings[k] for k in kept]

    def blocks() -> Iterator[Block]:
        for block in chain([first], source.blocks):
            yield [_seconds(clock.ns(block)) if clock and k in taken else _numbers(block[k]) for k in kept]

    return replace(source, headings=unique_headings(headings), blocks=blocks())


def clock_among(
    headings: Sequence[Heading], values: Block, notes: list[str]
) -> tuple[tuple[int, ...], Heading, np.ndarray] | None:
    """The columns [n] that together are a clock of stamps or counts, what it is called, and its times: ns since 1970
    [int64], or s since the first row [float] where no date is told; None without one."""
    clock = _clock(headings, values, notes)
    if clock is None:
        return None
    ns = clock.ns(values)
    start = clock.start()
    return clock.columns, clock.heading, _seconds(ns) if start is None else np.where(ns == NOTHING, ns, ns + start)


def _seconds(ns: np.ndarray) -> np.ndarray:
    return np.where(ns == NOTHING, np.nan, ns / SECOND)


def _numbers(values: np.ndarray) -> np.ndarray:
    return np.array([np.nan if v is None else v for v in values] if values.dtype.kind == "O" else values, dtype=float)


def _are_long(cells: np.ndarray) -> bool:
    """Whether cells are whole numbers, of more digits than a double has."""
    filled = [cell for cell in cells[:_LOOKED] if cell]
    return bool(filled) and all(cell.strip().isdecimal() for cell in filled)


def _clock(headings: Sequence[Heading], first: Block, notes: list[str]) -> _Clock | None:
    """The clock of a table by its first block: dates of a library, then stamps, then counts since an epoch."""
    for k, values in enumerate(first):
        if values.dtype.kind in "Mm" and _moves(values) and not _is_part(values):
            began = values[~np.isnat(values)][0]
            notes.append(f'"{headings[k].cell}" read as seconds from the first row, {_shown(began)}')
            start = int(began.astype("M8[ns]").astype(np.int64)) if began.dtype.kind == "M" else None
            return _Clock((k,), Heading(headings[k].cell, "s"), _native(k, began), _told(start))
    columns = _stamped(first)
    if columns:
        return _of_text(columns, headings, first, notes)
    return _of_counts(headings, first, notes)


def _told(start: int | None) -> Callable[[], int | None]:
    return lambda: start


def _is_part(values: np.ndarray) -> bool:
    """Whether dates [n] of a library are whole days, and durations [n] times of day: either may need the other."""
    known = values[~np.isnat(values)]
    if values.dtype.kind == "M":
        return bool(np.all(known == known.astype("M8[D]")))
    return bool(np.all((known >= np.timedelta64(0)) & (known < np.timedelta64(1, "D"))))


def _moves(values: np.ndarray) -> bool:
    known = values[~np.isnat(values)]
    return known.size > 0 and (known.size < 2 or bool(np.any(known != known[0])))


def _shown(began: np.generic) -> str:
    if began.dtype.kind == "M":
        return str(began.astype("M8[us]"))
    return f"{began.astype('m8[ns]').astype(float) * 1e-9:g} s"


def _native(column: int, began: np.generic) -> Callable[[Block], np.ndarray]:
    return lambda block: (block[column] - began).astype("m8[ns]").astype(np.int64)


def _stamped(first: Block) -> tuple[int, ...]:
    """Columns that are a clock: one with date and time, or a date beside a time of day, or one of them."""
    full, dates, times = [], [], []
    for k, values in enumerate(first):
        if values.dtype.kind in "Mm" and np.any(~np.isnat(values)) and _is_part(values):
            (dates if values.dtype.kind == "M" else times).append((not _moves(values), k))
        if values.dtype.kind != "O" or _are_long(values):
            continue
        stamps = [stamp for cell in values[:_LOOKED] if (stamp := stamp_of(cell)) is not None]
        if stamps:
            day, time = any(stamp.day is not None for stamp in stamps), any(stamp.ns is not None for stamp in stamps)
            (full if day and time else dates if day else times).append((len(set(stamps)) < 2 < len(stamps), k))
    if not times:  # the day of a recording is no clock
        dates = [(still, k) for still, k in dates if not still or first[k].dtype.kind == "O"]
    for kind in (full, dates, times):
        kind.sort()  # those that move first
    if full and not (full[0][0] and times):
        return (full[0][1],)
    return tuple(kind[0][1] for kind in (dates, times) if kind)


def _of_text(columns: tuple[int, ...], headings: Sequence[Heading], first: Block, notes: list[str]) -> _Clock:
    name = " ".join(headings[k].cell for k in columns)
    began = " ".join(_first_cell(first[k]) for k in columns)
    notes.append(f'dates and times in "{name}" read as seconds from the first row, {began}')
    dated = Dated(name, columns, notes)
    beside = _milliseconds(headings, first, dated.read(first)[1])
    if beside is None:
        return _Clock(columns, Heading(name, "s"), dated.ns, dated.start)
    notes.append(f'"{headings[beside].cell}" added to it')

    def ns(block: Block) -> np.ndarray:
        return dated.ns([np.asarray(values) for values in block], np.nan_to_num(block[beside] * 1e6).astype(np.int64))

    return _Clock((*columns, beside), Heading(name, "s"), ns, dated.start)


def _first_cell(values: np.ndarray) -> str:
    """The first stamp of a column as it is written."""
    if values.dtype.kind == "O":
        return next((cell.strip() for cell in values if stamp_of(cell) is not None), "")
    began = values[~np.isnat(values)][0]
    return str(began if began.dtype.kind == "M" else began.astype("m8[us]").item())


def _milliseconds(headings: Sequence[Heading], first: Block, ns: np.ndarray) -> int | None:
    """The column of what is beyond the whole seconds of stamps."""
    if np.any(ns[ns != NOTHING] % SECOND):
        return None
    for k, heading in enumerate(headings):
        values = first[k]
        if _MILLISECONDS.fullmatch(heading.cell.strip()) and values.dtype.kind in "fiu":
            known = values[np.isfinite(values)]
            if known.size and known.min() >= 0 and known.max() < 1000:
                return k
    return None


def _of_counts(headings: Sequence[Heading], first: Block, notes: list[str]) -> _Clock | None:
    """The first column, or pair of columns, that counts since an epoch."""
    for k, heading in enumerate(headings):
        name, numbers = name_of(heading.cell), _whole(first[k])
        own = name.rpartition(".")[2]  # of a structure
        if not numbers.size or not np.isfinite(numbers[0]):
            continue
        count = count_of(numbers, heading.unit)
        other = _nanoseconds(headings, name)
        if other is not None and count is not None and count.words == "s since 1970":
            start, rest = numbers[0], float(first[other][0])
            began = count.date(start + rest * 1e-9)
            notes.append(f'"{heading.cell}" and "{headings[other].cell}" count since 1970: taken as {_TAKEN}, {began}')
            ns = count.since_1970(start) + round(rest)
            return _Clock((k, other), _called(_stem(_SECONDS, name)), _pair(k, other, count, start, rest), _told(ns))
        if count is not None and (_CLOCK.fullmatch(name) or _CLOCK.fullmatch(own)):
            notes.append(f'"{heading.cell}" counts {count.words}: taken as {_TAKEN}, {count.date(numbers[0])}')
            ns = count.since_1970(numbers[0])
            return _Clock((k,), _called(name), _counting(k, count, numbers[0]), _told(ns))
    return None


_TAKEN = "seconds since the first row"


def _called(name: str) -> Heading:
    return Heading(f"{name} [s]", "s")


def _counting(column: int, count: Count, start: np.generic) -> Callable[[Block], np.ndarray]:
    return lambda block: counted(_whole(block[column]), count, start)


def _pair(column: int, other: int, count: Count, start: np.generic, rest: float) -> Callable[[Block], np.ndarray]:
    def ns(block: Block) -> np.ndarray:
        seconds, beyond = counted(_whole(block[column]), count, start), np.asarray(block[other], dtype=float)
        known = (seconds != NOTHING) & np.isfinite(beyond)
        return np.where(known, seconds + np.nan_to_num(beyond - rest).astype(np.int64), NOTHING)

    return ns


def _whole(values: np.ndarray) -> np.ndarray:
    """Numbers [n], with all the digits of whole ones in text."""
    if values.dtype.kind in "iuf":
        return values
    if values.dtype.kind == "O" and _are_long(values) and all(values):
        return np.array([int(cell) for cell in values], dtype=np.int64)
    return _numbers(values) if values.dtype.kind in "Ob" and _are_long(values) else np.empty(0)


def _nanoseconds(headings: Sequence[Heading], seconds: str) -> int | None:
    """The column of what is beyond the whole seconds of another."""
    stem = _stem(_SECONDS, seconds)
    cells = [heading.cell for heading in headings]
    return next((k for k, cell in enumerate(cells) if stem and _stem(_NANOSECONDS, cell) == stem), None)


def _stem(pattern: re.Pattern[str], name: str) -> str:
    match = pattern.fullmatch(name)
    return match["stem"].rstrip("._ /") if match else ""
