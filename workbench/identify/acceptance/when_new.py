"""The rig as its valve's sheet had it when it was new: numbers that play the sheet again, with intervals.

Numbers of the valve that have a range in the rig file are found by Gauss-Newton steps on the sheet's lines, each
weighed by its interval; the range itself counts as one more reading, so that what no line tells stays as declared.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...rigs.number import Number
from ...rigs.rig import Rig
from .exact import exact_lines

_ROUNDS, _STEP, _ENOUGH = 12, 0.02, 1e-3  # of Gauss-Newton; of half of a range; a step that ends it
_DERIVED = ("linearity", "symmetry", "flow_gain_null", "main_flow")  # lines that others say better
_NARROWEST = 1e-3  # of a line: what reading it off records and computing it may differ by
_Z = 1.96


@dataclass(frozen=True)
class NewRig:
    """A rig with its valve as a sheet has it, names of the numbers that were found, and how well they play it:
    `chi2` of its `lines`, 1 or less where intervals hold them."""

    rig: Rig
    names: tuple[str, ...]
    chi2: float
    lines: int


def rig_when_new(rig: Rig, rows: Mapping[str, Mapping[str, float]], source: str) -> NewRig:
    """`rows`: lines of a valve's sheet by id, each with value, low and high in the line's unit.

    Raises InputError for a rig without a servo-valve or whose valve has no numbers with a range, and for a sheet with
    fewer lines than those.
    """
    if not (rig.is_jack and rig.is_throttled):
        raise InputError(f"{rig.name}: has no servo-valve that {source} may be of; name a rig with one")
    names = _free(rig)
    if not names:
        raise InputError(f"{rig.name}: no number of its valve has bounds; declare those that a sheet may tell")
    own = exact_lines(rig)
    rows = {id: row for id, row in rows.items() if id in own and id not in _DERIVED and _reading(row)[1] > 0}
    if len(rows) < len(names):
        raise InputError(f"{source}: {len(rows)} lines that {rig.name} plays, fewer than {len(names)} numbers of it")
    value, deviation = (np.array(column) for column in zip(*map(_reading, rows.values()), strict=True))
    x, normal, off = _solved(rig, names, list(rows), value, deviation)
    chi2 = float(np.sum(off**2)) / max(1, off.size - len(names))
    spread = np.sqrt(np.diag(np.linalg.inv(normal)) * max(1.0, chi2))
    found = {
        name: _number(rig.numbers[name], each, deviation, source)
        for name, each, deviation in zip(names, x.tolist(), spread.tolist(), strict=True)
    }
    told = tuple(name for name in names if found[name] is not rig.numbers[name])
    return NewRig(replace(rig, numbers={**rig.numbers, **found}), told, chi2, off.size)


def _free(rig: Rig) -> tuple[str, ...]:
    """Numbers of the valve that have a range."""
    schema = rig.valve_kind.schema(rig.corrector)
    own = [number for name, number in rig.numbers.items() if name in schema]
    return tuple(n.name for n in own if n.low is not None and n.high is not None and n.low < n.high)


def _reading(row: Mapping[str, float]) -> tuple[float, float]:
    half = (row["high"] - row["low"]) / 2
    return row["value"], float(np.hypot(half / _Z, _NARROWEST * abs(row["value"])))


def _solved(
    rig: Rig, names: tuple[str, ...], lines: list[str], value: np.ndarray, deviation: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers in halves of their ranges from the declared values, their information, and what lines are off."""

    def off(x: np.ndarray) -> np.ndarray:
        played = exact_lines(rig.with_values(**dict(zip(names, _values(rig, names, x), strict=True))))
        return np.array([played.get(id, np.nan) for id in lines] - value) / deviation

    x, normal, now = np.zeros(len(names)), np.eye(len(names)), off(np.zeros(len(names)))
    for _ in range(_ROUNDS):
        slopes = np.array([(off(x + _STEP * unit) - now) / _STEP for unit in np.eye(x.size)]).T
        seen = np.isfinite(slopes).all(axis=1) & np.isfinite(now)
        normal = slopes[seen].T @ slopes[seen] + np.eye(x.size)
        step = np.linalg.solve(normal, slopes[seen].T @ now[seen] + x)
        x = x - step
        now = off(x)
        if np.abs(step).max() < _ENOUGH:
            break
    return x, normal, now[np.isfinite(now)]


def _values(rig: Rig, names: tuple[str, ...], x: np.ndarray) -> list[float]:
    """Inside what physics allows."""
    specs = [rig.specs[name] for name in names]
    wanted = [rig[name] + _half(rig.numbers[name]) * float(each) for name, each in zip(names, x, strict=True)]
    return [float(np.clip(each, spec.low, spec.high)) for each, spec in zip(wanted, specs, strict=True)]


def _half(number: Number) -> float:
    assert number.low is not None
    assert number.high is not None
    return (number.high - number.low) / 2


def _number(number: Number, x: float, spread: float, source: str) -> Number:
    """The number as the sheet narrows it; as declared where the sheet says no more."""
    if _Z * spread >= 1:
        return number
    value, reach = number.value + _half(number) * x, _Z * _half(number) * spread
    what = f"valve sheet {source}; it was: {number.source}"
    return replace(number, value=value, low=value - reach, high=value + reach, source=what)
