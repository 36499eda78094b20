"""Numbers of a rig that are others in some records: in a session, or more and more as they drift.

A number that is positive over its range is the rig's own times a factor, another is the rig's own and a shift; with
weight w, the factor to the power of w, or w shifts. In a session w is 1; where a number drifts, w counts the records
before. Numbers stay in the ranges that the rig declares.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, nearest
from ...plant import Plant, build
from ...records import Campaign
from ...records.campaign import FILE
from ...records.sessions import RECORD, DeclaredSession, Drift
from ...rigs.number import Number
from ...rigs.rig import Rig
from ..data.noise_floor import same_command
from .determined import FreeParameter
from .windows import WindowGroup, Windows

_LEAST, _MOST = 0.5, 2.0  # factors: beyond, it is no other state of one rig


@dataclass(frozen=True)
class SessionNumber:
    """A number of the rig in the records of a session or drift: the rig's own times `start`, or plus it (see
    `is_factor`), as often as `weights` say, by record.

    `low` and `high`, SI, are the ends of the number's range; `fitted`: a fit moves it from its start; `per` is "record"
    or "repeat" of a drift, empty of a session.
    """

    session: str
    number: str
    weights: Mapping[str, float]
    start: float
    low: float
    high: float
    fitted: bool
    per: str = ""

    @property
    def name(self) -> str:
        """The name of this free parameter."""
        return f"{self.number} ({self.session})"

    @property
    def is_factor(self) -> bool:
        """Whether it multiplies the rig's own number, rather than adds to it."""
        return self.low > 0

    def free(self) -> FreeParameter:
        """What a fit moves."""
        if self.is_factor:
            return FreeParameter(self.name, self.start, _LEAST, _MOST, None, "of a session")
        width = self.high - self.low
        return FreeParameter(self.name, self.start, -width, width, width / 2, "of a session")

    def values(self, base: np.ndarray, change: float, weight: np.ndarray) -> np.ndarray:
        """The number [w], SI, with weights [w], where it would be `base` [w]."""
        return np.clip(self._changed(base, change, weight), self.low, self.high)

    def slopes(self, base: np.ndarray, change: float, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slopes [w] of the values to `base` and to the change; none at an end of the range."""
        value = self._changed(base, change, weight)
        inside = (self.low <= value) & (value <= self.high)
        if self.is_factor:
            return inside * change**weight, inside * base * weight * change ** (weight - 1)
        return 1.0 * inside, inside * weight

    def _changed(self, base: np.ndarray, change: float, weight: np.ndarray) -> np.ndarray:
        return base * change**weight if self.is_factor else base + change * weight


def session_numbers(campaign: Campaign, rig: Rig) -> tuple[SessionNumber, ...]:
    """What differs in the campaign's sessions, numbers that it declares and those that the rig has for a session, and
    what drifts.

    A declared number is fitted where train records tell it. Raises InputError for a number that the rig lacks or that
    has no bounds.
    """
    train = {record.name for record in campaign.train}
    sessions = [
        _session_number(campaign, rig, session, name, train)
        for session in campaign.sessions
        for name in dict.fromkeys((*session.numbers, *rig.sessions.get(session.name, {})))
    ]
    drifts = [_drifting(campaign, rig, drift, name) for drift in campaign.drifts for name in drift.numbers]
    return (*sessions, *drifts)


def session_plants(campaign: Campaign, rig: Rig) -> dict[str, Plant]:
    """The plant of each record's session, by record: one plant for all records of a session.

    Raises InputError as `session_numbers` does.
    """
    session_numbers(campaign, rig)
    plants = {name: build(rig.in_session(name)) for name in (None, *(session.name for session in campaign.sessions))}
    return {record.name: plants[campaign.session_of(record.name)] for record in campaign.records}


def session_windows(
    numbers: Sequence[SessionNumber], parameters: Sequence[str], windows: Windows, group: WindowGroup
) -> list[tuple[int, np.ndarray]]:
    """For each number its parameter, and its weights in the windows of a group [w]."""
    names = [windows.records[windows.spans[w][0]].name for w in group.which]
    return [
        (parameters.index(number.number), np.array([number.weights.get(name, 0.0) for name in names]))
        for number in numbers
    ]


def _session_number(campaign: Campaign, rig: Rig, own: DeclaredSession, name: str, train: set[str]) -> SessionNumber:
    number, low, high = _bounded(rig, name, f"{campaign.path / FILE}: sessions.{own.name}.numbers")
    others = {n for each in campaign.sessions if name in each.numbers for n in each.records}
    fitted = name in own.numbers and bool(train & set(own.records)) and bool(train - others)
    start = _start(number, rig.sessions.get(own.name, {}).get(name))
    return SessionNumber(own.name, name, dict.fromkeys(own.records, 1.0), start, low, high, fitted)


def _drifting(campaign: Campaign, rig: Rig, drift: Drift, name: str) -> SessionNumber:
    number, low, high = _bounded(rig, name, f"{campaign.path / FILE}: drifts.{drift.name}.numbers")
    by_name = {record.name: record for record in campaign.records}
    records = [by_name[own] for own in drift.records]
    weights = {
        record.name: float(sum(drift.per == RECORD or same_command(before, record) for before in records[:place]))
        for place, record in enumerate(records)
    }
    fitted = len({weights.get(record.name, 0.0) for record in campaign.train}) > 1
    return SessionNumber(drift.name, name, weights, _start(number, None), low, high, fitted, drift.per)


def _bounded(rig: Rig, name: str, place: str) -> tuple[Number, float, float]:
    """A number of the rig with the ends of its range, SI."""
    if name not in rig.numbers:
        raise InputError(f"{place}: rig {rig.name} has no number {name[:80]}; {nearest(name[:80], rig.numbers)}")
    number = rig.numbers[name]
    if number.low is None or number.high is None or not number.low < number.high:
        free = ", ".join(each.name for each in rig.numbers.values() if each.low is not None)
        raise InputError(f"{place}: {name} of rig {rig.name} has no bounds, so it is not fitted; choose from {free}")
    return number, number.low, number.high


def _start(number: Number, in_session: Number | None) -> float:
    value = number.value if in_session is None else in_session.value
    return value / number.value if number.low is not None and number.low > 0 else value - number.value
