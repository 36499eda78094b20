"""Channels with clocks of their own on one clock, the fastest: between its samples a channel is held, or drawn."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.signals import DRIVING
from ..columns import HELD, LINEAR, beside
from ..repair import continuous
from .origin import clock_among
from .source import UNREAD, Heading, Source, unique_headings
from .stamps import NOTHING, SECOND, count_of, counted
from .unit_names import name_of
from .vocabulary import strengths

_SAME = 1e-3  # of a period: clocks that differ by less are one
_UNEVEN, _MOST_UNEVEN = 0.5, 0.2  # by which an interval differs from the median; share of them of an even clock
CLOCK = Heading("t", "s")


@dataclass(frozen=True)
class ChannelGroup:
    """Channels [n] that were sampled together, numbers or cells of text [object], among which a clock is looked for
    where none is told; `t` [n] is their clock: s of the file's own [float] or ns since 1970
    [int64], None where it is not told.

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
        """Median interval, s, of a group with a clock in s."""
        assert self.t is not None
        return float(np.median(np.diff(self.t)))

    def at(self, t: np.ndarray) -> "ChannelGroup":
        """The group with its clock [n] in s, the column of it too."""
        pairs = [
            (Heading(heading.cell, "s"), t) if values is self.t else (heading, values)
            for heading, values in zip(self.headings, self.values, strict=True)
        ]
        return replace(self, headings=tuple(h for h, _ in pairs), values=tuple(v for _, v in pairs), t=t)


def on_one_clock(groups: Sequence[ChannelGroup], notes: list[str]) -> Source:
    """All channels side by side. Those of a group without a clock that is not of the others' length are left out."""
    groups = [_with_stamps(group, notes) for group in groups if group.rows > 1]
    groups = _mended(_from_one_origin([group for group in groups if group.rows], notes), notes)
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


def _size(group: ChannelGroup) -> int:
    return group.rows * len(group.values)


def _with_stamps(group: ChannelGroup, notes: list[str]) -> ChannelGroup:
    """The group on the clock that its stamps or counts tell, where it has no other; its other text is left out."""
    numbers = any(values.dtype.kind != "O" for values in group.values)
    found = clock_among(group.headings, group.values, notes) if numbers and group.t is None else None
    columns, heading, t = found or ((), CLOCK, group.t)
    pairs = list(zip(group.headings, group.values, strict=True))
    pairs = [(heading, t) if k in columns[:1] else pair for k, pair in enumerate(pairs) if k not in columns[1:]]
    left = [f'{h.cell} ("{next(filter(None, v), "")}")' for h, v in pairs if v is not None and v.dtype.kind == "O"]
    if left:
        notes.append(f"{UNREAD}: {', '.join(left)}")
    own = [(h, v if v is t else v.astype(float)) for h, v in pairs if v is not None and v.dtype.kind != "O"]
    headings, values = tuple(h for h, _ in own), tuple(v for _, v in own)
    return replace(group, headings=headings, values=values, t=t, has_clock_column=bool(found) or group.has_clock_column)


def _from_one_origin(groups: Sequence[ChannelGroup], notes: list[str]) -> list[ChannelGroup]:
    """The groups with clocks in s: those that tell the date from where the first of them begins."""
    dated = [None if group.t is None else _since_1970(group.t) for group in groups]
    begun = {k: int(ns[ns != NOTHING][0]) for k, ns in enumerate(dated) if ns is not None and np.any(ns != NOTHING)}
    if not begun:
        return list(groups)
    first = min(begun, key=lambda k: begun[k])
    moved = list(groups)
    for k, start in begun.items():
        ns = dated[k]
        assert ns is not None
        moved[k] = groups[k].at(np.where(ns == NOTHING, np.nan, (ns - begun[first]) / SECOND))
        if start > begun[first]:
            late = (start - begun[first]) / SECOND
            notes.append(f"{groups[k].name}: begins {late:.9g} s after {groups[first].name}, as the file says")
    others = [g.name for k, g in enumerate(groups) if g.t is not None and k not in begun]
    if others:
        notes.append(f"{', '.join(others)}: no date beside {groups[first].name}; taken to begin with it")
    return moved


def _since_1970(t: np.ndarray) -> np.ndarray | None:
    """A clock in ns since 1970 [n], where it tells the date."""
    if t.dtype.kind == "i":
        return t
    count = count_of(t, None)
    if count is None:
        return None
    start = t[np.isfinite(t)][0]
    ns = counted(t, count, start)
    return np.where(ns == NOTHING, NOTHING, ns + count.since_1970(start))


def _mended(groups: Sequence[ChannelGroup], notes: list[str]) -> list[ChannelGroup]:
    """The groups that have a clock that goes on, or none; what was mended or left out is noted."""
    kept = []
    for group in groups:
        if group.t is None:
            kept.append(group)
            continue
        t, said = continuous(group.t)
        notes += [f"{group.name}: {each}" for each in said]
        rising = np.concatenate(([True], t[1:] > np.fmax.accumulate(t)[:-1]))
        if 2 * np.sum(rising) < t.size or np.sum(rising) < 2:
            notes.append(f"left out, time stamps that repeat or run backwards: {group.name}, {_listed(group)}")
            continue
        if not rising.all():
            notes.append(f"{group.name}: {np.sum(~rising)} rows left out whose time stamps repeat or run backwards")
        own = group.at(t) if said else group
        values = tuple(t[rising] if each is own.t else each[rising] for each in own.values)
        place = next((k for k, each in enumerate(own.values) if each is own.t), None)
        kept.append(replace(own, values=values, t=t[rising] if place is None else values[place]))
    return kept


def _listed(group: ChannelGroup) -> str:
    return ", ".join(f'"{heading.cell}"' for heading in group.headings[:5])


def _joined(group: ChannelGroup, lead: ChannelGroup, notes: list[str]) -> list[tuple[Heading, np.ndarray]]:
    """The channels of a group on the clock of another."""
    own = [pair for pair in zip(group.headings, group.values, strict=True) if pair[1] is not group.t]
    if group.t is None or lead.t is None:
        if group.rows == lead.rows:
            return own
        notes.append(f"left out, {group.rows} values without a clock beside {lead.rows} rows: {_listed(group)}")
        return []
    nearest = np.clip(np.searchsorted(group.t, lead.t - lead.period / 2), 0, group.rows - 1)
    inside = (lead.t >= group.t[0] - _SAME * lead.period) & (lead.t <= group.t[-1] + _SAME * lead.period)
    if np.all(np.abs(group.t[nearest] - lead.t)[inside] <= _SAME * lead.period):  # a sample in every row
        return [(heading, np.where(inside, values[nearest], np.nan)) for heading, values in own]
    return [each for heading, values in own for each in _resampled(heading, values, group, lead, notes)]


def _resampled(
    heading: Heading, values: np.ndarray, group: ChannelGroup, lead: ChannelGroup, notes: list[str]
) -> list[tuple[Heading, np.ndarray]]:
    """A channel at the rows of another clock in the way that it goes between its samples, and in the other way beside
    it; NaN where it has no sample yet, or none any more that says more than the last."""
    assert group.t is not None
    assert lead.t is not None
    way, reason = _between(heading, values, group.t)
    other = LINEAR if way == HELD else HELD
    last = np.searchsorted(group.t, lead.t + _SAME * lead.period, side="right") - 1
    held = np.where(last < 0, np.nan, values[np.maximum(last, 0)])
    both = {HELD: held, LINEAR: np.interp(lead.t, group.t, values, left=np.nan, right=np.nan)}
    how = "held" if way == HELD else "on straight lines"
    rates = f"resampled from {1 / group.period:.4g} Hz to {1 / lead.period:.4g} Hz"
    notes.append(f"{heading.cell}: {rates}, {how} between its samples{reason}")
    return [
        (replace(heading, between=way), both[way]),
        (Heading(beside(heading.cell, other), heading.unit, other), both[other]),
    ]


def _between(heading: Heading, values: np.ndarray, t: np.ndarray) -> tuple[str, str]:
    """How a channel goes between its samples, and why."""
    steps = np.diff(t)
    if set(strengths(name_of(heading.cell))) & set(DRIVING):
        return HELD, " as a drive does"
    if np.mean(np.abs(steps / np.median(steps) - 1) > _UNEVEN) > _MOST_UNEVEN:
        return HELD, " as it is logged on change"
    known = values[np.isfinite(values)]
    if known.size and np.array_equal(known, np.rint(known)):
        return HELD, " as whole numbers are"
    return LINEAR, ""
