"""TDMS files of LabVIEW, read by npTDMS: channels with units, a clock of their own by start and increment."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...base.files import MOST_READ, check_numbers, open_file
from .clocks import ChannelGroup, on_one_clock
from .optional import needed
from .source import Heading, Source
from .unit_names import named

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsGroup

_UNITS = ("unit_string", "NI_UnitDescription", "Unit", "unit")


def read_tdms(path: Path) -> Source:
    """Every channel of numbers. Raises InputError where npTDMS is missing, and for more than there is memory for."""
    tdms = needed("nptdms", "tdms")
    with open_file(path, kind="recording") as stream, tdms.TdmsFile.open(stream) as file:
        check_numbers(path, sum(len(channel) for group in file.groups() for channel in group.channels()), MOST_READ)
        groups = [part for group in file.groups() for part in _groups(group)]
    return on_one_clock(groups, [])


def _groups(group: "TdmsGroup") -> list[ChannelGroup]:
    """Channels of one length and clock together."""
    alike: dict[tuple[int, int | None, float, float], list[TdmsChannel]] = {}
    for channel in group.channels():
        if len(channel) > 1 and np.dtype(channel.dtype).kind in "iufbM":
            start, step = (float(channel.properties.get(f"wf_{key}", 0.0)) for key in ("start_offset", "increment"))
            alike.setdefault((len(channel), _date(channel), start, step), []).append(channel)
    return [_group(group.name, alike[rows, date, start, step], date, start, step) for rows, date, start, step in alike]


def _date(channel: "TdmsChannel") -> int | None:
    """When a waveform begins, ns since 1970."""
    told = channel.properties.get("wf_start_time")
    return None if told is None else int(np.datetime64(told, "ns").astype(np.int64))


def _group(name: str, channels: "list[TdmsChannel]", date: int | None, start: float, step: float) -> ChannelGroup:
    values = tuple(_numbers(channel) for channel in channels)
    headings = tuple(_heading(channel) for channel in channels)
    t = start + step * np.arange(values[0].size) if step > 0 else None
    if t is not None and date:
        t = date + np.rint(1e9 * t).astype(np.int64)
    stamps = [v for channel, v in zip(channels, values, strict=True) if np.dtype(channel.dtype).kind == "M"]
    return ChannelGroup(name, headings, values, stamps[0] if stamps else t, bool(stamps))


def _numbers(channel: "TdmsChannel") -> np.ndarray:
    values = np.asarray(channel[:])
    if values.dtype.kind == "M":
        return values.astype("M8[ns]").astype(np.int64)
    return values.astype(float)


def _heading(channel: "TdmsChannel") -> Heading:
    if np.dtype(channel.dtype).kind == "M":
        return Heading(channel.name, "s")
    units = [channel.properties[name] for name in _UNITS if str(channel.properties.get(name, "")).strip()]
    return named(channel.name, str(units[0]) if units else "")
