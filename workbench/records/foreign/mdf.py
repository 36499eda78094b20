"""MDF files, version 3 and 4, read by asammdf: channel groups with a master clock each."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...base.files import MOST_READ, check_numbers
from .clocks import ChannelGroup, on_one_clock
from .optional import needed
from .source import Source
from .unit_names import named

if TYPE_CHECKING:
    from asammdf import MDF, Signal


def read_mdf(path: Path) -> Source:
    """Every channel of numbers. Raises InputError where asammdf is missing, and for more than there is memory for."""
    asammdf = needed("asammdf", "mdf")
    with asammdf.MDF(path) as file:
        numbers = sum(len(group.channels) * group.channel_group.cycles_nr for group in file.groups)
        check_numbers(path, numbers, MOST_READ)
        groups = [group for index in range(len(file.groups)) if (group := _group(file, index)) is not None]
    return on_one_clock(groups, [])


def _group(file: "MDF", index: int) -> ChannelGroup | None:
    """The channels of one group on its master; None where none has numbers."""
    master = file.masters_db.get(index)
    places = [(None, index, place) for place in range(len(file.groups[index].channels)) if place != master]
    signals = [s for s in file.select(places) if s.samples.dtype.kind in "iufb" and s.samples.ndim == 1]
    signals = [s for s in signals if s.samples.size > 1]
    if not signals:
        return None
    name = getattr(file.groups[index].channel_group, "acq_name", "") or f"group {index + 1}"
    values = tuple(np.where(_valid(s), s.samples.astype(float), np.nan) for s in signals)
    headings = tuple(named(s.name, s.unit) for s in signals)
    return ChannelGroup(name, headings, values, np.asarray(signals[0].timestamps, dtype=float))


def _valid(signal: "Signal") -> np.ndarray:
    bad = signal.invalidation_bits
    return np.ones(signal.samples.size, bool) if bad is None else ~np.asarray(bad, dtype=bool)
