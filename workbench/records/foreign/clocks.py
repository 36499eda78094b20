"""Channels with clocks of their own on one clock: the fastest; the others on straight lines between their samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .source import Heading, Source, unique_headings

_SAME = 1e-3  # of a period: clocks that differ by less are one
CLOCK = Heading("t", "s")


@dataclass(frozen=True)
class Group:
    """Channels [n] that were sampled together; `t` [n] s is their clock, None where it is not told.

    has_clock_column: one of the channels is that clock already.
    """

    name: str
    headings: tuple[Heading, ...]
    values: tuple[np.ndarray, ...]
    t: np.ndarray | None = None
    has_clock_column: bool = False

    @property
    def rows(self) -> int:
        """Samples of each channel."""
        return self.values[0].size if self.values else 0

    @property
    def period(self) -> float:
        """Median interval, s, of a group with a clock."""
        assert self.t is not None
        return float(np.median(np.diff(self.t)))


def on_one_clock(groups: Sequence[Group], notes: list[str]) -> Source:
    """All channels side by side. Those of a group without a clock that is not of the others' length are left out."""
    groups = [group for group in groups if group.rows > 1]
    if not groups:
        return Source((), iter(()), None, notes)
    timed = [group for group in groups if group.t is not None]
    lead = min(timed, key=lambda group: group.period) if timed else max(groups, key=_size)
    headings, values = list(lead.headings), list(lead.values)
    if lead.t is not None and not lead.has_clock_column:
        headings, values = [CLOCK, *headings], [lead.t, *values]
    for group in [group for group in groups if group is not lead]:
        joined = _joined(group, lead, notes)
        headings += [heading for heading, _ in joined]
        values += [numbers for _, numbers in joined]
    return Source(unique_headings(headings), iter([values]), None, notes)


def _size(group: Group) -> int:
    return group.rows * len(group.values)


def _joined(group: Group, lead: Group, notes: list[str]) -> list[tuple[Heading, np.ndarray]]:
    """The channels of a group on the clock of another."""
    own = [pair for pair in zip(group.headings, group.values, strict=True) if pair[1] is not group.t]
    if group.t is None or lead.t is None:
        if group.rows == lead.rows:
            return own
        listed = ", ".join(f'"{heading.cell}"' for heading in group.headings[:5])
        notes.append(f"left out, {group.rows} values without a clock beside {lead.rows} rows: {listed}")
        return []
    if _is_same(group.t, lead.t):
        return own
    rates = f"{1 / group.period:.4g} Hz to {1 / lead.period:.4g} Hz"
    notes.append(f"{group.name}: resampled from {rates}, on straight lines between its samples")
    return [(heading, _resampled(lead.t, group.t, values)) for heading, values in own]


def _is_same(t: np.ndarray, other: np.ndarray) -> bool:
    return t.size == other.size and bool(np.max(np.abs(t - other)) <= _SAME * np.median(np.diff(other)))


def _resampled(t: np.ndarray, own: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values at t [n]; NaN outside their own time, and where one of the two neighbours is missing."""
    return np.interp(t, own, values, left=np.nan, right=np.nan)
