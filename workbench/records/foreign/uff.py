"""Universal files, data sets 58 and 58b, read by pyuff: real functions of time, each on a clock of its own."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.errors import InputError, short_path
from ...base.files import open_file
from ...base.units import to_si
from .clocks import ChannelGroup, on_one_clock
from .optional import needed
from .source import Heading, Source
from .unit_names import named, plain_unit

if TYPE_CHECKING:
    from pyuff import UFF

_NAMES = ("id1", "rsp_ent_name", "ordinate_axis_lab", "id5", "id2")  # where programs put a channel's name
_KINDS = {
    2: "auto spectrum", 3: "cross spectrum", 4: "frequency response", 5: "transmissibility", 6: "coherence",
    7: "auto correlation", 8: "cross correlation", 9: "power spectral density", 12: "spectrum",
}  # fmt: skip
_DIRECTIONS = ("", "X", "Y", "Z", "RX", "RY", "RZ")
_TIME, _UNKNOWN = 17, (0, 1)  # specific data types of an abscissa


def read_uff(path: Path) -> Source:
    """Every real function of time; what else is in the file is noted and left out.

    Raises InputError where pyuff is missing and for a file without such a function, ValueError for a broken one.
    """
    pyuff = needed("pyuff", "uff")
    _check_end(path)
    functions = _functions(pyuff.UFF(str(path)))
    reasons = Counter(reason for function in functions if (reason := _reason(function)))
    told = [function for function in functions if not _reason(function)]
    groups = _groups(told)
    others = ", ".join(f"{count} of {reason}" for reason, count in reasons.items())
    if not told:
        found = f"only {others}" if others else "no data set 58"
        raise InputError(f"{short_path(path)}: no function of time in it, {found}; export the time histories")
    return on_one_clock(groups, [f"left out, no real functions of time: {others}"] if others else [])


def _check_end(path: Path) -> None:
    with open_file(path, kind="recording") as file:
        if not file.read().rstrip().endswith(b"-1"):
            raise ValueError("it does not end with the mark -1 of a universal file")


def _functions(file: "UFF") -> list[dict[str, Any]]:
    """The data sets 58, each with as many points as it tells. Raises ValueError for a broken one."""
    found = []
    for place in np.flatnonzero(np.asarray(file.get_set_types()) == 58).tolist():
        try:
            function: Any = file.read_sets(place)
        except Exception:
            raise ValueError(f"data set {place + 1} cannot be read") from None
        points = function["num_pts"]
        if not 0 < points <= len(function["data"]):
            raise ValueError(f"data set {place + 1} tells {points} points and has {len(function['data'])}")
        found.append(function | {"data": function["data"][:points], "x": function["x"][:points]})
    return found


def _reason(function: Mapping[str, Any]) -> str:
    """What a function is that is no real function of time; nothing where it is one."""
    kind, abscissa = function["func_type"], function["abscissa_spec_data_type"]
    if kind not in (0, 1):
        return _KINDS.get(kind, f"function type {kind}")
    if abscissa != _TIME and not (kind == 1 and abscissa in _UNKNOWN):
        return "abscissa other than time"
    return "complex numbers" if np.iscomplexobj(function["data"]) else ""


def _groups(functions: Sequence[Mapping[str, Any]]) -> list[ChannelGroup]:
    """Functions of one clock together."""
    clocks = [_seconds(function) for function in functions]
    headings = _headings(functions)
    alike: dict[tuple[float, ...], list[int]] = {}
    for place, t in enumerate(clocks):
        alike.setdefault((t.size, t[0], t[-1]), []).append(place)
    return [
        ChannelGroup(
            ", ".join(headings[place].cell for place in places),
            tuple(headings[place] for place in places),
            tuple(np.asarray(functions[place]["data"], dtype=float) for place in places),
            clocks[places[0]],
        )
        for places in alike.values()
    ]


def _seconds(function: Mapping[str, Any]) -> np.ndarray:
    """The abscissa [n], s. Raises ValueError where it does not rise, or its unit is not of time."""
    unit = function["abscissa_axis_units_lab"]
    try:
        t = to_si(function["x"], plain_unit(unit), "s") if _is_told(unit) else np.asarray(function["x"], dtype=float)
    except InputError as error:
        raise ValueError(str(error)) from None
    if not np.all(np.diff(t) > 0):
        raise ValueError("a time axis that does not rise")
    return t


def _headings(functions: Sequence[Mapping[str, Any]]) -> list[Heading]:
    """Names from where they tell all functions apart, else with the point and direction of each."""
    for key in _NAMES:
        names = [function[key].strip() for function in functions]
        if all(map(_is_told, names)) and len(set(names)) == len(names):
            break
    else:
        names = [f"{function['id1'].strip() if _is_told(function['id1']) else 'point'} {_point(function)}"
                 for function in functions]  # fmt: skip
    units = [function["ordinate_axis_units_lab"] for function in functions]
    return [named(name, unit) for name, unit in zip(names, units, strict=True)]


def _point(function: Mapping[str, Any]) -> str:
    direction = function["rsp_dir"]
    axis = _DIRECTIONS[abs(direction)] if abs(direction) < len(_DIRECTIONS) else str(direction)
    return f"{function['rsp_node']}{'-' if direction < 0 and axis else ''}{axis}"


def _is_told(label: str) -> bool:
    return label.strip().upper() not in ("", "NONE")
