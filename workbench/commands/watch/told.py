"""A change with its name: suspects fitted to sessions before and after, and the course of the one that is named."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...identify.watch.changes import Change, History, course, smoothed
from ...identify.watch.naming import Explained, Name, name_of, suspects
from ...records.dated_sessions import DatedSession
from .reader import SessionReader

_NEWEST = 2  # sessions that a name is judged by
NORMAL = 1.96  # standard deviations in half of a 95 % interval


@dataclass(frozen=True)
class Told:
    """A change, the session [index] of the first alarm, and its name.

    By session [index]: the `course` of what is named, value and standard deviation, and all `numbers` of the rig then.
    `rate`: the size, of a drift a year, with its 95 % interval.
    """

    change: Change
    first_alarm: int
    name: Name
    label: str
    course: Mapping[int, tuple[float, float]]
    numbers: Mapping[int, Mapping[str, float]]
    rate: tuple[float, float, float] | None
    rate_unit: str


def named(
    reader: SessionReader, sessions: Sequence[DatedSession], known: History, change: Change, first_alarm: int
) -> Told:
    """Name a change by fits. A session in which no fit is near is passed over."""
    before = max(change.earliest - 1, 0)
    moves = smoothed(known.until(before + 1), None)[0].mean(axis=0)
    axes = [known.axes[k].name for k in suspects(known, moves)]
    old = _explained(reader, sessions, before, axes)
    newest = list(range(len(sessions) - 1, change.first - 1, -1))[:_NEWEST]
    fits = [_explained(reader, sessions, t, axes) for t in newest]
    new = {axis: [each[axis] for each in fits if axis in each] for axis in axes}
    name = name_of(old, {axis: list(each) for axis, each in new.items() if each})
    if not name.among:
        return Told(change, first_alarm, name, "", {}, {}, None, "")
    best = name.among[0]
    values: dict[int, Explained] = {}
    for t in range(max(change.earliest - 1, 0), len(sessions)):
        if found := _explained(reader, sessions, t, [best]):
            values[t] = found[best]
    unit = next(axis.unit for axis in known.axes if axis.name == best)
    rate = _rate(known.days, change, values)
    return Told(
        change,
        first_alarm,
        name,
        f"{best} [{unit}]",
        {t: (each.value, each.deviation) for t, each in values.items()},
        {t: each.numbers for t, each in values.items()},
        rate,
        f"{unit}/year" if change.shape == "drift" else unit,
    )


def _explained(
    reader: SessionReader, sessions: Sequence[DatedSession], t: int, axes: Sequence[str]
) -> dict[str, Explained]:
    what = f"{', '.join(axes)} on the session of {sessions[t].day}"
    try:
        return reader.explained(sessions[t].load(), axes, what)
    except InputError:
        return {}


def _rate(days: np.ndarray, change: Change, values: Mapping[int, Explained]) -> tuple[float, float, float] | None:
    """The size of the change, of a drift a year, with 95 %: a line through its values since it began."""
    since = sorted(values)
    if len(since) < 2:
        return None
    s = course(days, change.first, change.shape)[since]
    y = np.array([values[t].value for t in since])
    design = np.column_stack((np.ones(len(since)), s))
    weights = 1.0 / np.maximum([values[t].deviation for t in since], 1e-3 * np.ptp(y) + 1e-300)
    solved, *_ = np.linalg.lstsq(design * weights[:, None], y * weights, rcond=None)
    left = (y - design @ solved) * weights
    scatter = max(1.0, float(left @ left) / max(len(since) - 2, 1))
    covariance = scatter * np.linalg.pinv((design * weights[:, None]).T @ (design * weights[:, None]))
    half = NORMAL * float(np.sqrt(covariance[1, 1]))
    return float(solved[1]), float(solved[1] - half), float(solved[1] + half)
