"""How a valve's null shifts with the supply pressure and the oil's temperature, from records at two of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Campaign, Record
from ...rigs.rig import Rig
from .row import Row, unsaid
from .valve_test import Shift, valve_sheet

_APART = 0.1  # of the lower supply: two groups of records are at least so far apart


@dataclass(frozen=True, eq=False)
class State:
    """Records at one supply pressure [Pa] or oil temperature [K], its `level`, and the rig as it is there."""

    level: float
    records: Sequence[Record]
    rig: Rig


def null_shift(line: Shift, states: Sequence[State]) -> Row:
    """The nulls of the lowest and the highest level, over their difference; the 95 % of both count."""
    if len(states) < 2:
        return unsaid(line.id, line.meaning, "%", line.none)
    ends = [pick(states, key=lambda state: state.level) for pick in (min, max)]
    rows = [next(row for row in valve_sheet(s.records, s.rig).rows if row.id == "null_bias") for s in ends]
    nulls = [(r.value, r.low, r.high) for r in rows if r.value is not None and r.low is not None and r.high is not None]
    if len(nulls) < 2 or ends[0].level == ends[1].level:
        return unsaid(line.id, line.meaning, "%", "the null is not seen at two levels")
    per = line.per / (ends[1].level - ends[0].level)
    (first, low, high), (second, under, over) = nulls
    reach = abs(per) * float(np.hypot(high - low, over - under)) / 2
    value = per * (second - first)
    return Row(line.id, line.meaning, "%", value, value - reach, value + reach)


def by_temperature(campaign: Campaign, rig: Rig) -> list[State]:
    """The records of each session whose oil temperature is declared."""
    moving = (*campaign.train, *campaign.select, *campaign.heldout)
    return [
        State(each.temperature, [record for record in moving if record.name in each.records], rig)
        for each in campaign.sessions
        if each.temperature is not None
    ]


def by_supply(campaign: Campaign, rig: Rig) -> list[State]:
    """The records at the lowest and those at the highest of the supply pressures that were recorded, if they differ."""
    moving = (*campaign.train, *campaign.select, *campaign.heldout)
    at = [(float(np.median(r.signals["supply"])), r) for r in moving if "supply" in r.signals]
    if not at or "Ps" not in rig:
        return []
    low, high = min(level for level, _ in at), max(level for level, _ in at)
    if high < (1 + _APART) * low:
        return []
    near = _APART / 2
    ends = ([(level, r) for level, r in at if abs(level / end - 1) < near] for end in (low, high))
    return [
        State(level := float(np.mean([x for x, _ in own])), [r for _, r in own], rig.with_values(Ps=level))
        for own in ends
    ]
