"""A change with its name: suspects fitted to sessions before and after, and the course of the one that is named."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from ...records.dated_sessions import DatedSession
from .changes import Case, Change
from .history import History, Shape, course
from .known_then import NORMAL
from .naming import (
    BESIDE,
    SECOND,
    Explained,
    Explanations,
    Name,
    Suspects,
    name_of,
    nearest,
    pair_of,
    seems_two,
    suspects,
)
from .reader import SessionReader
from .smoothed import smoothed

_FEWEST = 4
_UNEVEN = 0.05  # of how far it went: no wear follows a line more closely
_COURSE = 12  # sessions that what is named is fitted to, at most


@dataclass(frozen=True)
class NamedChange:
    """A change, the session [index] of the first alarm, and its name.

    By session [index]: the `course` of what is named, value and standard deviation, all `numbers` of the rig then, and
    its `days`. `moving`: the numbers of what is named. Of two that are named together the first has the numbers.
    `rate`: the size, of a drift a year, with its 95 % interval. Of a change without a name none of these is known.
    """

    change: Change
    first_alarm: int
    name: Name
    label: str
    course: Mapping[int, tuple[float, float]]
    numbers: Mapping[int, Mapping[str, float]]
    rate: tuple[float, float, float] | None
    rate_unit: str
    moving: tuple[str, ...]
    days: Mapping[int, float]

    def is_unknown(self, session: int) -> bool:
        """Whether the rig is not known in a session, since what has changed has no name."""
        over = self.change.end is not None and session >= self.change.end
        return self.name.axis is None and session >= self.change.earliest and not over

    def unsteady(self, ahead: float) -> float:
        """The relative standard deviation of the rate over so many days `ahead`: as unlike as the rates between fitted
        sessions have been, and as much as the later half of them is unlike all; 1 at most."""
        at = sorted(t for t in self.course if t >= self.change.first - 1)
        t, y = np.array([self.days[k] for k in at]), np.array([self.course[k][0] for k in at])
        if len(t) < _FEWEST:
            return 1.0
        rates, mean = np.diff(y) / np.diff(t), (y[-1] - y[0]) / (t[-1] - t[0])
        late = (y[-1] - y[len(y) // 2]) / (t[-1] - t[len(y) // 2])
        scatter = float(np.std(rates, ddof=1) / abs(mean)) if mean else 1.0
        walk = scatter * np.sqrt(1 / len(rates) + np.diff(t).mean() / max(ahead, 1.0))
        return min(float(np.hypot(walk, (late - mean) / (late or 1.0))), 1.0)

    def among(self, left: np.ndarray) -> "NamedChange":
        """This change of sessions `left` [k], by their numbers among all."""
        by_all = {int(left[t]): t for t in self.days}
        return replace(
            self,
            change=self.change.among(left),
            first_alarm=int(left[self.first_alarm]),
            course={own: self.course[t] for own, t in by_all.items()},
            numbers={own: self.numbers[t] for own, t in by_all.items() if self.numbers},
            days={own: self.days[t] for own, t in by_all.items()},
        )

    def numbers_at(self, day: float, days: np.ndarray) -> dict[str, float]:
        """The rig's numbers on a day, linear between the sessions that were fitted; before them none, and none once the
        change has ended; after them what is named goes on by a line through the later half of them, the others stay as
        they are."""
        fitted, end = sorted(self.numbers), self.change.end
        if not fitted or day < self.days[fitted[0]] or (end is not None and day >= days[end]):
            return {}
        t = np.array([self.days[k] for k in fitted])
        values = {name: np.array([self.numbers[k][name] for k in fitted]) for name in self.numbers[fitted[-1]]}
        now = {name: float(np.interp(day, t, value)) for name, value in values.items()}
        late = t >= t[-1] - 0.5 * (t[-1] - t[0])
        if day > t[-1] and late.sum() > 1:
            for name in self.moving:
                slope, _ = np.polyfit(t[late], values[name][late], 1)
                now[name] += float(slope) * (day - t[-1])
        return now


def numbers_then(told: Sequence[NamedChange], day: float, days: np.ndarray) -> dict[str, float]:
    """The rig's numbers on a day by the changes that are there then."""
    return {name: value for each in told for name, value in each.numbers_at(day, days).items()}


def named(
    reader: SessionReader,
    sessions: Sequence[DatedSession],
    known: History,
    change: Change,
    first_alarm: int,
    usual: float,
) -> list[NamedChange]:
    """Name a change by fits to the sessions of its life: two where two wear at once. A session in which no fit is near
    is passed over."""
    over = len(sessions) if change.end is None else change.end
    before = max(change.earliest - 1, 0)
    moves = smoothed(known.until(before + 1))[0].mean(axis=0)
    every = [known.axes[k].name for k in suspects(known.until(over), first_alarm, moves)]
    axes, new = every, dict[str, list[Explained]]()
    for t in sorted({first_alarm, over - 1}):
        for (axis,), each in _explained(reader, sessions, t, [(axis,) for axis in axes]).items():
            new.setdefault(axis, []).append(each[axis])
        if new:
            axes = nearest(usual, {axis: new[axis][-1] for axis in axes if axis in new})
    name = name_of(usual, {axis: new[axis] for axis in axes if axis in new})
    fitted = fitted_sessions(before, over)

    def courses(axes: Suspects, found: Sequence[Name], latest: int) -> list[NamedChange]:
        values = {t: each[axes] for t in fitted if (each := _explained(reader, sessions, t, [axes]))}
        return [
            _with_course(known, change, latest, one, {t: each[str(one.axis)] for t, each in values.items()})
            for one in found
        ]

    least = {axis.name: SECOND if axis.unit == "typical" else BESIDE for axis in known.axes}
    if both := _both(reader, sessions, over - 1, usual, every, axes, least):
        one, other = str(both.axis), both.among[0]
        told = courses(_pair(one, other), [Name(one, (one,), both.share), replace(both, axis=other)], over - 1)
        if all(each.name.axis for each in told):
            moving = tuple(number for each in told for number in each.moving)
            told = [replace(each, first_alarm=max(first_alarm, each.change.first)) for each in told]
            return [replace(told[0], moving=moving), replace(told[1], numbers={})]
    return courses((name.axis,), [name], first_alarm) if name.axis else [_unnamed(change, first_alarm, name)]


def _unnamed(change: Change, first_alarm: int, name: Name) -> NamedChange:
    return NamedChange(change, first_alarm, replace(name, axis=None), "", {}, {}, None, "", (), {})


def _both(
    reader: SessionReader,
    sessions: Sequence[DatedSession],
    t: int,
    usual: float,
    every: Sequence[str],
    best: Sequence[str],
    least: Mapping[str, float],
) -> Name | None:
    """The two that wear at once, where one suspect leaves much of a session and a pair with one of the `best` two does
    not."""

    def alone(axes: Sequence[str]) -> dict[str, Explained]:
        found = _explained(reader, sessions, t, [(axis,) for axis in axes])
        return {axis: each[axis] for (axis,), each in found.items()}

    first = alone(best[:2])
    if not first or not all(seems_two(usual, each, least[axis]) for axis, each in first.items()):
        return None
    others = alone(every)
    pairs = list(dict.fromkeys(_pair(a, b) for a in first for b in others if a != b))
    both = _explained(reader, sessions, t, pairs)
    return pair_of(usual, others, {pair: each[pair[0]] for pair, each in both.items()}, least)


def _pair(one: str, other: str) -> Suspects:
    return (min(one, other), max(one, other))


def _with_course(
    known: History, change: Change, latest: int, name: Name, values: Mapping[int, Explained]
) -> NamedChange:
    """A change that is named, as it went from the `latest` session on or before; without a name where it may be
    nothing."""
    change = _as_it_went(known.days, change, latest, values)
    best = str(name.axis)
    unit = next(axis.unit for axis in known.axes if axis.name == best)
    rate = _rate(known.days, change, values)
    if rate and rate[1] <= 0 <= rate[2]:  # what may be nothing has no name
        return _unnamed(change, latest, name)
    return NamedChange(
        change,
        latest,
        name,
        f"{best} [{unit}]",
        {t: (each.value, each.deviation) for t, each in values.items()},
        {t: each.numbers for t, each in values.items()},
        rate,
        f"{unit}/year" if change.shape == "drift" else unit,
        _moving(best, values),
        {t: float(known.days[t]) for t in values},
    )


def _moving(best: str, values: Mapping[int, Explained]) -> tuple[str, ...]:
    """The numbers that go on: the one that is named, or those of the effect."""
    names = next(iter(values.values())).numbers if values else {}
    return tuple(name for name in names if name == best or name.startswith(f"{best}."))


def fitted_sessions(first: int, count: int) -> list[int]:
    """The sessions from `first` on, of so many, that what is named is fitted to: evenly, and the newest. The step is
    doubled as they become more, so that a new session asks for no other fit than its own."""
    step = 1
    while (count - 1 - first) > step * (_COURSE - 1):
        step *= 2
    return sorted({*range(first, count, step), count - 1})


def _explained(
    reader: SessionReader, sessions: Sequence[DatedSession], t: int, suspects: Sequence[Suspects]
) -> Explanations:
    return reader.explained(sessions[t].load(), suspects, f"the session of {sessions[t].day}")


def _as_it_went(days: np.ndarray, change: Change, told: int, values: Mapping[int, Explained]) -> Change:
    """The change with the beginning and the shape that the course of what is named shows: its fits are far sharper than
    what all axes together say to first order. It has begun with the session that it was `told` after."""
    if len(values) < _FEWEST:
        return change
    at = sorted(values)
    y = np.array([values[t].value for t in at])
    firsts = range(max(at[0], 1), max(min(at[-1], told), at[0], 1) + 1)
    cases: list[Case] = [(first, shape, None) for first in firsts for shape in get_args(Shape)]
    left = [_left_of_line(course(days, *case)[at], y) for case in cases]
    first, shape, _ = cases[int(np.argmin(left))]
    return replace(
        change,
        first=first,
        shape=shape,
        earliest=min(first, change.earliest),
        latest=max(first, min(change.latest, told)),
    )


def _left_of_line(s: np.ndarray, y: np.ndarray) -> float:
    design = np.column_stack((np.ones(len(s)), s))
    return float(np.sum((y - design @ np.linalg.lstsq(design, y, rcond=None)[0]) ** 2))


def _rate(days: np.ndarray, change: Change, values: Mapping[int, Explained]) -> tuple[float, float, float] | None:
    """The size of the change, of a drift a year, with 95 %: a line through its values since it began."""
    since = sorted(values)
    if len(since) < 2:
        return None
    s = course(days, change.first, change.shape)[since]
    y = np.array([values[t].value for t in since])
    design = np.column_stack((np.ones(len(since)), s))
    weights = 1.0 / np.maximum([values[t].deviation for t in since], _UNEVEN * np.ptp(y) + 1e-300)
    solved, *_ = np.linalg.lstsq(design * weights[:, None], y * weights, rcond=None)
    left = (y - design @ solved) * weights
    scatter = max(1.0, float(left @ left) / max(len(since) - 2, 1))
    covariance = scatter * np.linalg.pinv((design * weights[:, None]).T @ (design * weights[:, None]))
    half = NORMAL * float(np.sqrt(covariance[1, 1]))
    return float(solved[1]), float(solved[1] - half), float(solved[1] + half)
