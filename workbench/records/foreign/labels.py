"""What stands beside numbers in a structure and says what they are: names, units, a sample rate; cells of numbers."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...base.words import counted
from .clocks import ChannelGroup
from .nested import Leaf, Tree
from .stamps import is_stamp
from .unit_names import is_unit

_NAMES = re.compile(r"name|label|head|channel|kanal|column|spalte|signal|var|title|voie", re.I)
_UNITS = re.compile(r"unit|einheit", re.I)
_RATE = re.compile(
    r"(?:f_?s|f_?sample|f_?sampling|fe|sr|sampl(?:e|ing)_?(?:rate|freq|frequency)|scan_?rate|abtast_?(?:rate|frequenz))"
    r"(?:_?(?:in_?)?(?P<unit>k?hz))?",
    re.I,
)
_PERIOD = re.compile(
    r"(?:d_?t|delta_?t|t_?s|te|t_?sample|sampl(?:e|ing)_?(?:time|period|interval)|abtast_?(?:zeit|periode)|(?:wf_)?increment)"
    r"(?:_?(?:in_?)?(?P<unit>[mu]?s|sec))?",
    re.I,
)
_FACTORS = {"khz": 1e3, "ms": 1e-3, "us": 1e-6}
_LISTED = 8  # things that are left out

Part = Any
"""Leaf, text, several texts, several leaves, a number or a structure; None of what is none of these."""


def labelled(tree: Mapping[str, Part], rates: dict[str, tuple[float, str]], left: list[str], where: str = "") -> Tree:
    """The structure with names and units in the matrices that they stand beside, and cells as matrices or structures.

    Sample rates are added to `rates`, as seconds from row to row and as they stand there, by the place of their
    structure; what is neither a signal nor said of one to `left`.
    """
    tree = {name: _stamps(part) for name, part in tree.items()}
    parts = dict(tree)
    texts = {name: part for name, part in parts.items() if isinstance(part, tuple) and isinstance(part[0], str)}
    used: set[str] = set()
    for name, part in tree.items():
        path = f"{where}.{name}" if where else name
        if name in texts:
            del parts[name]
        elif isinstance(part, Mapping):
            parts[name] = labelled(part, rates, left, path)
        elif isinstance(part, tuple):
            parts[name] = _cells(part, _labels(texts, name, len(part), used))
        elif isinstance(part, Leaf) and part.values.ndim == 2 and not part.names:
            parts[name] = replace(part, names=_labels(texts, name, part.values.shape[1], used))
        elif isinstance(part, float) or part is None:
            del parts[name]
            if part is not None and (period := _period(name, part)):
                rates.setdefault(where, (period, f'"{path}" = {part:g}'))
            else:
                left.append(path if part is None else f"{path} = {part:g}")
    left += [f"{where}.{name}" if where else name for name in texts if name not in used]
    return parts


def _stamps(part: Part) -> Part:
    """Cells of text that are dates or times as a column; any other part as it is."""
    texts = isinstance(part, tuple) and len(part) > 1 and isinstance(part[0], str)
    return Leaf(np.array(part, dtype=object)) if texts and is_stamp(next(filter(None, part), "")) else part


def cells_part(parts: Sequence[Part], shape: Sequence[int]) -> Part:
    """An array of cells, row by row: texts, a column of numbers, vectors, a table under a header, or a structure."""
    shape = [length for length in shape if length != 1]
    if len(shape) == 2:
        return _table([list(parts[i : i + shape[1]]) for i in range(0, len(parts), shape[1])])
    if not parts:
        return None
    if all(isinstance(part, str) for part in parts):
        return tuple(part.strip() for part in parts)
    if _are_numbers(parts):
        return Leaf(_floats(parts)) if len(parts) > 1 else parts[0]
    if all(isinstance(part, Leaf) for part in parts):
        return tuple(parts)
    return {str(i): part for i, part in enumerate(parts, 1)}


def _table(rows: list[list[Part]]) -> Part:
    """Cells in two dimensions: columns of numbers under their names and units; else column by column, or row by row."""
    head = next((i for i, row in enumerate(rows) if any(isinstance(part, float) for part in row)), len(rows))
    columns = [list(column) for column in zip(*rows, strict=True)]
    numeric = [j for j, column in enumerate(columns) if _are_numbers(column[head:])]
    if len(rows) - head > 1 and numeric and (head or len(numeric) == len(columns)):
        names = tuple(_with_unit(str(columns[j][0] or ""), str(columns[j][1])) for j in numeric if head)
        leaf = Leaf(np.column_stack([_floats(columns[j][head:]) for j in numeric]), None, names)
        texts = {j: columns[j][head:] for j in range(len(columns)) if j not in numeric}
        others = {
            str(columns[j][0] or j + 1): tuple(text) if all(isinstance(cell, str) for cell in text) else None
            for j, text in texts.items()
        }
        return {"cells": leaf, **others} if others else leaf
    alike = min((rows, columns), key=lambda lines: sum(len(set(map(type, line))) for line in lines))
    return {str(i): cells_part(line, [len(line)]) for i, line in enumerate(alike, 1)}


def _are_numbers(parts: Iterable[Part]) -> bool:
    """Whether cells have a number each, or nothing."""
    found = [part for part in parts if part is not None]
    return bool(found) and all(isinstance(part, float) for part in found)


def _floats(parts: Iterable[float | None]) -> np.ndarray:
    return np.array([np.nan if part is None else part for part in parts])


def _cells(leaves: tuple[Leaf, ...], names: tuple[str, ...]) -> Part:
    """Vectors in cells: a matrix where they have one length."""
    if len({leaf.values.shape for leaf in leaves}) == 1 and leaves[0].values.ndim == 1:
        return Leaf(np.column_stack([leaf.values for leaf in leaves]), None, names)
    return dict(zip(names or map(str, range(1, len(leaves) + 1)), leaves, strict=True))


def _labels(texts: Mapping[str, tuple[str, ...]], matrix: str, width: int, used: set[str]) -> tuple[str, ...]:
    """Names for so many columns, with their units, of the texts that are as many; those are then used."""
    fitting = sorted(
        (name for name, part in texts.items() if len(part) == width),
        key=lambda name: (matrix not in name, name in used, not _NAMES.search(name)),
    )
    units = [name for name in fitting if _UNITS.search(name)]
    named = [name for name in fitting if name not in units and len(set(texts[name])) == width]
    used |= {*units[:1], *named[:1]}
    names = texts[named[0]] if named else [f"{matrix} {i}" for i in range(1, width + 1)]
    return tuple(map(_with_unit, names, texts[units[0]] if units else [""] * width)) if named or units else ()


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit and is_unit(unit) else name


def is_rate(name: str) -> bool:
    """Whether a number of this name is a sample rate or period."""
    return bool(_RATE.fullmatch(name) or _PERIOD.fullmatch(name))


def _period(name: str, number: float) -> float | None:
    """Seconds from row to row, of a number by its name."""
    if not (np.isfinite(number) and number > 0):
        return None
    if match := _RATE.fullmatch(name):
        return 1.0 / (number * _FACTORS.get((match["unit"] or "").lower(), 1.0))
    if match := _PERIOD.fullmatch(name):
        return number * _FACTORS.get((match["unit"] or "").lower(), 1.0)
    return None


def with_rates(
    groups: Sequence[ChannelGroup], rates: Mapping[str, tuple[float, str]], left: list[str], notes: list[str]
) -> list[ChannelGroup]:
    """The groups; the longest without a clock, of a structure with a sample rate, on a clock of that rate."""
    groups = list(groups)
    for where, (period, told) in sorted(rates.items(), key=lambda rate: -len(rate[0])):
        inside = [i for i, group in enumerate(groups) if group.t is None and _is_in(group.name, where)]
        rows = max((groups[i].rows for i in inside), default=0)
        if rows < 2 or any(group.t is not None and _is_in(group.name, where) for group in groups):
            left.append(f"{told} (there is a clock)" if groups else told)
            continue
        notes.append(f"{told} is the clock: {period:.9g} s from row to row")
        for i in inside:
            if groups[i].rows == rows:
                groups[i] = replace(groups[i], t=period * np.arange(rows))
    return groups


def _is_in(name: str, where: str) -> bool:
    return not where or name == where or name.startswith(f"{where}.")


def left_out(left: Sequence[str]) -> list[str]:
    """The note on what is left out, where anything is."""
    if not left:
        return []
    more = f" and {counted(len(left) - _LISTED, 'other')}" if len(left) > _LISTED else ""
    return [f"left out, no signals: {', '.join(left[:_LISTED])}{more}"]
