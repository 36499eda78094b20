"""A load cell at rest beside a reference: error, repeatability, hysteresis, zero, in the manner of ISO 7500-1."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.special import gammaincinv

from ...base.errors import InputError
from ...records import Record
from .row import CONFIDENCE, Estimate, Row, measured, unsaid

_WINDOW, _CALM = 0.3, 0.01  # s, and of the record's range: what goes less far in so long is held
_HELD = 0.5  # s, at least
_DRIFT = 2e-3  # of the record's range, between two quarters of a level: what drifts further has not settled
_APART = 0.03  # of the capacity: levels that lie nearer to each other are repeats of one
_LOADED = 0.05  # of the capacity: below, an error is no share of the force
_MIDDLE = (0.25, 0.75)  # of the largest force: where both ways lie furthest apart
_LACKS = "no record force-static with force and reference_force: levels held, up and down, three times over"


@dataclass(frozen=True)
class Level:
    """A held force [N], by the reference and as indicated, and whether it was reached from below; None: the first."""

    reference: float
    indicated: float
    rising: bool | None

    @property
    def error(self) -> float:
        """Indicated less true [N]."""
        return self.indicated - self.reference


@dataclass(frozen=True, eq=False)
class StaticTest:
    """Levels of all records, and by their repeats the standard deviation [N] of one, with its degrees of freedom."""

    levels: Sequence[Level]
    capacity: float

    def repeats(self, rising: bool | None = None) -> list[list[Level]]:
        """The levels of each force, from low to high; those come to one way alone where `rising` says so."""
        ordered = sorted(self.levels, key=lambda level: level.reference)
        groups: list[list[Level]] = []
        for level in ordered:
            if groups and level.reference - groups[-1][-1].reference < _APART * self.capacity:
                groups[-1].append(level)
            else:
                groups.append([level])
        kept = [[level for level in group if rising is None or level.rising is rising] for group in groups]
        return [group for group in kept if group]

    @property
    def scatter(self) -> Estimate:
        """Standard deviation [N] of a level's error about that of its repeats, as a value, and its freedom."""
        groups = [group for way in (True, False) for group in self.repeats(way) if len(group) > 1]
        freedom = sum(len(group) - 1 for group in groups)
        squares = sum(float(np.var([level.error for level in group])) * len(group) for group in groups)
        return Estimate(float(np.sqrt(squares / freedom)) if freedom else np.nan, np.nan, freedom)

    def mean(self, levels: Sequence[Level]) -> Estimate:
        """The mean error [N] of repeated levels."""
        scatter = self.scatter
        error = float(np.mean([level.error for level in levels]))
        return Estimate(error, scatter.value / np.sqrt(len(levels)), scatter.freedom)


def static_test(records: Sequence[Record], capacity: float) -> StaticTest | None:
    """The test that records force-static make, None where none has both forces. Raises InputError for brief levels."""
    both = [record for record in records if {"force", "reference_force"} <= set(record.names)]
    return StaticTest([level for record in both for level in _levels(record)], capacity) if both else None


def static_rows(test: StaticTest | None, reference: float) -> list[Row]:
    """Lines of a static test; `reference`: half of the reference's own 95 % interval, as a share of the force."""
    if test is None or not test.scatter.freedom:
        why = _LACKS if test is None else "no level was repeated: go up and down over the range three times"
        ids = {"static_error": "error of the indicated force", **_MEANINGS}
        return [unsaid(id, meaning, "%", why) for id, meaning in ids.items()]
    loaded = [g for g in test.repeats(True) if abs(g[0].reference) > _LOADED * test.capacity]
    return [*(_error(test, group, reference) for group in loaded), _repeatability(test), _hysteresis(test), _zero(test)]


def span_error(test: StaticTest | None) -> Estimate | None:
    """Slope of the indicated force over the true one, less 1, of rising levels; None without a test."""
    if test is None or not test.scatter.freedom or len(test.repeats(True)) < 3:
        return None
    levels = [level for group in test.repeats(True) for level in group]
    r = np.array([level.reference for level in levels])
    slope = float(np.polyfit(r, [level.error for level in levels], 1)[0])
    return Estimate(slope, test.scatter.value / float(np.sqrt(np.sum((r - r.mean()) ** 2))), test.scatter.freedom)


_MEANINGS = {
    "repeatability": "standard deviation of repeated indications of a force, over the capacity",
    "hysteresis": "indicated on the way down less on the way up, in the middle of the range, over the capacity",
    "zero": "indicated without load, over the capacity",
}


def _error(test: StaticTest, group: Sequence[Level], reference: float) -> Row:
    force = float(np.mean([level.reference for level in group]))
    percent = round(100 * force / test.capacity)
    name = f"static_error_{'minus_' * (percent < 0)}{abs(percent)}"
    estimate = test.mean(group)
    relative = Estimate(estimate.value / force, estimate.deviation / abs(force), estimate.freedom)
    meaning = f"error of the indicated force at {force / 1e3:.3g} kN, way up, over it"
    return widened(measured(name, meaning, "%", relative, 100.0), 100 * reference)


def widened(row: Row, reach: float) -> Row:
    """A row whose interval holds another cause of its own reach, in its unit, by the root of the sum of squares."""
    if row.value is None or row.low is None or row.high is None or not reach:
        return row
    low, high = (row.value - np.hypot(row.value - row.low, reach), row.value + np.hypot(row.high - row.value, reach))
    return Row(row.id, row.meaning, row.unit, row.value, float(low), float(high))


def _repeatability(test: StaticTest) -> Row:
    scatter = test.scatter
    value = 100 * scatter.value / test.capacity
    low, high = (
        value * float(np.sqrt(scatter.freedom / 2 / gammaincinv(scatter.freedom / 2, part)))
        for part in (0.5 + CONFIDENCE / 2, 0.5 - CONFIDENCE / 2)
    )
    return Row("repeatability", _MEANINGS["repeatability"], "%", value, low, high)


def _hysteresis(test: StaticTest) -> Row:
    most = max(abs(level.reference) for level in test.levels)
    ways = {way: test.repeats(way) for way in (True, False)}
    pairs = [
        (test.mean(down), test.mean(up))
        for down in ways[False]
        for up in ways[True]
        if abs(down[0].reference - up[0].reference) < _APART * test.capacity
        and _MIDDLE[0] * most < abs(up[0].reference) < _MIDDLE[1] * most
    ]
    if not pairs:
        return unsaid("hysteresis", _MEANINGS["hysteresis"], "%", "no force in the middle was come to both ways")
    apart = float(np.mean([down.value - up.value for down, up in pairs]))
    deviation = float(np.sqrt(sum(down.deviation**2 + up.deviation**2 for down, up in pairs))) / len(pairs)
    estimate = Estimate(apart, deviation, test.scatter.freedom)
    return measured("hysteresis", _MEANINGS["hysteresis"], "%", estimate, 100 / test.capacity)


def _zero(test: StaticTest) -> Row:
    rest = [level for level in test.levels if abs(level.reference) < _LOADED * test.capacity]
    if not rest:
        return unsaid("zero", _MEANINGS["zero"], "%", "no level without load")
    return measured("zero", _MEANINGS["zero"], "%", test.mean(rest), 100 / test.capacity)


def _levels(record: Record) -> list[Level]:
    """The held levels of a record, the second half of each. Raises InputError where they are held too short a time."""
    force, rows = record.signals["reference_force"], max(3, round(_WINDOW / record.period))
    jitter = 1.4826 * float(np.median(np.abs(np.diff(force)))) / np.sqrt(2)
    calm = _CALM * float(np.ptp(force)) + 10 * jitter
    held = maximum_filter1d(force, rows, mode="nearest") - minimum_filter1d(force, rows, mode="nearest") < calm
    edges = np.flatnonzero(np.diff(np.concatenate(([0], held.astype(int), [0]))))
    pieces = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    long = [(a, b) for a, b in pieces if (b - a + rows) * record.period >= _HELD]
    if len(long) < 3:
        what = f"{len(long)} levels of the force are held for {_HELD:g} s"
        raise InputError(f"record {record.name}: {what}, too short a dwell; hold each level until it has settled")
    for a, b in long:
        _check_settled(record, a, b, jitter)
    true, shown = (
        [float(np.mean(record.signals[name][(a + b) // 2 : b])) for a, b in long]
        for name in ("reference_force", "force")
    )
    ways = [None, *(after > before for before, after in pairwise(true))]
    return [Level(*each) for each in zip(true, shown, ways, strict=True)]


def _check_settled(record: Record, first: int, last: int, jitter: float) -> None:
    force, quarter = record.signals["reference_force"], (last - first) // 4
    third, fourth = force[last - 2 * quarter : last - quarter], force[last - quarter : last]
    apart = abs(float(fourth.mean() - third.mean()))
    if apart > _DRIFT * float(np.ptp(force)) + 4 * jitter / np.sqrt(quarter):
        raise InputError(
            f"record {record.name}: the level from {record.t[first]:.3g} to {record.t[last - 1]:.3g} s still drifts "
            f"by {apart / 1e3:.3g} kN; hold each level until it has settled"
        )
