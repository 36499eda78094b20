"""Numbers in nested structures, as MATLAB and HDF5 files have them: what lies beside a clock belongs to it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .clocks import ChannelGroup
from .source import Heading
from .stamps import count_of
from .unit_names import heading_of, name_of, plain_unit

_CLOCKS = ("t", "time", "zeit", "temps", "tout", "times", "timestamps")
_VALUES = ("data", "values", "value")
_UNITS = ("unit", "units", "dataunits", "einheit")
_NAMES = ("name", "label", "title")
_MOST = 64  # columns of a matrix that is a table of signals


@dataclass(frozen=True)
class Leaf:
    """Numbers [n] or [n, k], or text [n], with what is known of them: their unit, and the names of k columns."""

    values: np.ndarray
    unit: str | None = None
    names: tuple[str, ...] = ()


Tree = Mapping[str, Any]
"""Leaf, text or a structure again, by name."""


def groups_of(tree: Tree, where: str = "") -> list[ChannelGroup]:
    """The groups of a structure: a time series with its clock; else what has one length, with the clock among it."""
    lower = {name.lower(): part for name, part in tree.items()}
    clock = next((part for name in _CLOCKS if isinstance(part := lower.get(name), Leaf)), None)
    data = next((part for name in _VALUES if isinstance(part := lower.get(name), Leaf)), None)
    if clock is not None and data is not None and sum(isinstance(part, Leaf) for part in tree.values()) == 2:
        return [_timed(_told(lower, _NAMES) or where or "data", data, _told(lower, _UNITS), clock)]
    inside = [
        g for name, part in tree.items() if isinstance(part, Mapping) for g in groups_of(part, _path(where, name))
    ]
    if clock is not None and isinstance(lower.get("signals"), Mapping):  # of Simulink: a structure with time
        return [*(g if g.t is not None else _with_time(g, clock) for g in inside)]
    lengths: dict[int, list[tuple[str, Leaf]]] = {}
    for name, part in tree.items():
        if isinstance(part, Leaf):
            lengths.setdefault(part.values.shape[0], []).append((_path(where, name), part))
    if data is not None and sum(map(len, lengths.values())) == 1 and not inside:  # a channel without its own clock
        channel = replace(data, unit=data.unit or _told(lower, _UNITS))
        return [_plain(where, [(_told(lower, _NAMES) or where or "data", channel)])]
    return [*(_plain(where, leaves) for leaves in lengths.values()), *inside]


def _told(lower: Tree, names: tuple[str, ...]) -> str | None:
    return next((text.strip() for name in names if isinstance(text := lower.get(name), str) and text.strip()), None)


def _path(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


def _columns(name: str, leaf: Leaf) -> Iterator[tuple[Heading, np.ndarray]]:
    """The columns of a leaf, each [n]."""
    table = leaf.values.reshape(leaf.values.shape[0], -1)
    width = table.shape[1]
    names = leaf.names if len(leaf.names) == width else tuple(f"{name} {i}" for i in range(1, width + 1))
    for i, title in enumerate((name,) if width == 1 and not leaf.names else names):
        heading = heading_of(title)
        unit = plain_unit(leaf.unit) if leaf.unit else heading.unit
        yield Heading(title, unit), _kept(table[:, i])


def _kept(values: np.ndarray) -> np.ndarray:
    """Numbers [n]; text, and whole numbers that count since an epoch, as they are, which a double may cut."""
    counts = values.dtype.kind in "iu" and count_of(values, None) is not None
    return values if counts or values.dtype.kind == "O" else values.astype(float)


def _timed(title: str, data: Leaf, unit: str | None, clock: Leaf) -> ChannelGroup:
    pairs = list(_columns(title, Leaf(data.values, data.unit or unit, data.names)))
    return _with_time(ChannelGroup(title, tuple(h for h, _ in pairs), tuple(v for _, v in pairs)), clock)


def _with_time(group: ChannelGroup, clock: Leaf) -> ChannelGroup:
    """A group on a clock: of seconds, or of stamps or counts, which are then its first column."""
    t = _kept(clock.values.ravel())
    if t.dtype.kind == "f":
        return replace(group, t=t)
    return replace(group, headings=(Heading("t"), *group.headings), values=(t, *group.values))


def _plain(where: str, leaves: list[tuple[str, Leaf]]) -> ChannelGroup:
    """Columns of one length; one of them that is called a clock, and increases, is theirs."""
    pairs = [pair for name, leaf in leaves for pair in _columns(name, leaf)]
    clocks = [values for heading, values in pairs if _is_clock(heading, values)]
    t = clocks[0] if len(clocks) == 1 else None
    return ChannelGroup(where or "file", tuple(h for h, _ in pairs), tuple(v for _, v in pairs), t, t is not None)


def _is_clock(heading: Heading, values: np.ndarray) -> bool:
    called = name_of(heading.cell).rpartition(".")[2].lower() in _CLOCKS and heading.unit in (None, "s")
    return called and values.dtype.kind == "f" and values.size > 1 and bool(np.all(np.diff(values) > 0))


def as_leaf(values: np.ndarray, unit: str | None = None, names: tuple[str, ...] = ()) -> Leaf | None:
    """Numbers that may be signals, in columns; None of scalars, text, pictures and empty ones."""
    values = np.asarray(values)
    if values.dtype.kind not in "iufb" or values.ndim == 0 or values.size < 2:
        return None
    values = values.squeeze() if values.ndim > 2 else values
    if values.ndim > 2:
        return None
    if values.ndim == 2 and (values.shape[0] == 1 or values.shape[0] < values.shape[1] <= values.size // 2):
        values = values.T
    if values.ndim == 2 and (values.shape[1] > _MOST or values.shape[0] < 2):
        return None
    return Leaf(values.ravel() if values.ndim == 2 and values.shape[1] == 1 else values, unit, names)
