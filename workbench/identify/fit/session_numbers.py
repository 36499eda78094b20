"""Numbers of a rig that are others in a session: how they follow from the rig's, and what a fit may move of them.

A number that is positive over its range is the rig's own times a factor, another is the rig's own and a shift. Whatever
a session does, its numbers stay in the ranges that the rig declares.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, nearest
from ...plant import Plant, build
from ...records import Campaign
from ...records.campaign import FILE
from ...rigs.rig import Number, Rig
from .determined import FreeParameter
from .windows import Group, Windows

_LEAST, _MOST = 0.5, 2.0  # factors: beyond, it is no other state of one rig


@dataclass(frozen=True)
class SessionNumber:
    """A number of the rig in the `records` of a session: the rig's own times `start`, or plus it (see `is_factor`).

    `low` and `high`, SI, are the ends of the number's range; `fitted`: a fit moves it from its start.
    """

    session: str
    number: str
    records: frozenset[str]
    start: float
    low: float
    high: float
    fitted: bool

    @property
    def name(self) -> str:
        """As a free parameter."""
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

    def value(self, base: float, change: float) -> float:
        """The number in the session, SI, where the rig's own is `base`."""
        return float(np.clip(self._changed(base, change), self.low, self.high))

    def slopes(self, base: float, change: float) -> tuple[float, float]:
        """Slopes of the value to the rig's own number and to the change; none at an end of the range."""
        if not self.low <= self._changed(base, change) <= self.high:
            return 0.0, 0.0
        return (change, base) if self.is_factor else (1.0, 1.0)

    def _changed(self, base: float, change: float) -> float:
        return base * change if self.is_factor else base + change


def session_numbers(campaign: Campaign, rig: Rig) -> tuple[SessionNumber, ...]:
    """What differs in the campaign's sessions: numbers that it declares, and those that the rig has for a session.

    A declared number is fitted where train records of the session and others tell it. Raises InputError for a number
    that the rig lacks or that has no bounds.
    """
    train = {record.name for record in campaign.train}
    return tuple(
        _session_number(campaign, rig, session.name, name, train)
        for session in campaign.sessions
        for name in dict.fromkeys((*session.numbers, *rig.sessions.get(session.name, {})))
    )


def session_plants(campaign: Campaign, rig: Rig) -> dict[str, Plant]:
    """The plant of each record's session, by record: one plant for all records of a session.

    Raises InputError as `session_numbers` does.
    """
    session_numbers(campaign, rig)
    plants = {name: build(rig.in_session(name)) for name in (None, *(session.name for session in campaign.sessions))}
    return {record.name: plants[campaign.session_of(record.name)] for record in campaign.records}


def session_windows(
    numbers: Sequence[SessionNumber], parameters: Sequence[str], windows: Windows, group: Group
) -> list[tuple[int, int, np.ndarray]]:
    """Which session number, of which parameter, in which windows of a group."""
    names = [windows.records[windows.spans[w][0]].name for w in group.which]
    return [
        (k, parameters.index(number.number), np.flatnonzero([name in number.records for name in names]))
        for k, number in enumerate(numbers)
    ]


def _session_number(campaign: Campaign, rig: Rig, session: str, name: str, train: set[str]) -> SessionNumber:
    place = f"{campaign.path / FILE}: sessions.{session}.numbers"
    if name not in rig.numbers:
        raise InputError(f"{place}: rig {rig.name} has no number {name[:80]}; {nearest(name[:80], rig.numbers)}")
    number, (own,) = rig.numbers[name], (each for each in campaign.sessions if each.name == session)
    if number.low is None or number.high is None or not number.low < number.high:
        free = ", ".join(each.name for each in rig.numbers.values() if each.low is not None)
        raise InputError(f"{place}: {name} of rig {rig.name} has no bounds, so it is not fitted; choose from {free}")
    others = {n for each in campaign.sessions if name in each.numbers for n in each.records}
    fitted = name in own.numbers and bool(train & set(own.records)) and bool(train - others)
    start = _start(number, rig.sessions.get(session, {}).get(name))
    return SessionNumber(session, name, frozenset(own.records), start, number.low, number.high, fitted)


def _start(number: Number, in_session: Number | None) -> float:
    value = number.value if in_session is None else in_session.value
    return value / number.value if number.low is not None and number.low > 0 else value - number.value
