"""RPC III time histories, the drive files and responses of test rigs: 16-bit numbers or floats of one clock.

Blocks of 512 bytes with four records each, a keyword [32 bytes] and its value [96 bytes], each up to its first NUL;
then the numbers in groups of frames: all that a group has of channel 1, then of channel 2 ... The last group is filled
up, or ends with its last frame. Where in that frame the record ends the format does not say, so a tail that repeats
itself is left out. A 16-bit number times SCALE.CHAN_n is in the channel's unit; INT_FULL_SCALE only says how far the
numbers go. Source: MTS Systems, "RPC File Formats".
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import InputError, echo, short_path
from ...base.files import open_file
from ...base.words import counted
from .clocks import ChannelGroup, on_one_clock
from .source import Source
from .unit_names import named

_BLOCK, _RECORD, _KEYWORD = 512, 128, 32  # bytes
_ORDERS = {"BINARY": "<", "BINARY_IEEE_LITTLE_END": "<", "BINARY_IEEE_BIG_END": ">"}
_TYPES = {"SHORT_INTEGER": "i2", "FLOATING_POINT": "f4"}
_SILENT = {"FILE_TYPE": "TIME_HISTORY", "DATA_TYPE": "SHORT_INTEGER", "HALF_FRAMES": "0"}  # what goes without saying


@dataclass(frozen=True)
class _Header:
    """Values by their keywords, and how messages name the file."""

    shown: str
    values: Mapping[str, str]

    @property
    def has_half_frames(self) -> bool:
        """Whether there is one before the first frame and one after the last, which FRAMES may leave out."""
        return self.number("HALF_FRAMES") != 0

    def wrong(self, what: str) -> InputError:
        """A refusal that names the file."""
        return InputError(f"{self.shown}: {what}; export it again as an RPC III time history")

    def text(self, keyword: str) -> str:
        """Raises InputError for a keyword that is missing or has no value."""
        if not self.values.get(keyword):
            raise self.wrong(f"{keyword} is missing")
        return self.values[keyword]

    def number(self, keyword: str) -> float:
        """Raises InputError for what is missing or no finite number."""
        try:
            value = float(self.text(keyword))
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise self.wrong(f"{keyword} is {echo(self.text(keyword))}, no number")
        return value

    def count(self, keyword: str) -> int:
        """Raises InputError for what is missing or no whole number above 0."""
        value = self.number(keyword)
        if value < 1 or value != int(value):
            raise self.wrong(f"{keyword} is {value:g}, not a whole number above 0")
        return int(value)


def read_rpc(path: Path) -> Source:
    """Every channel, on the clock of DELTA_T.

    Raises InputError for what is no time history, and where counts, sizes and the file's length do not agree.
    """
    with open_file(path, kind="recording") as file:
        content = file.read()
    header = _header(short_path(path), content)
    period = header.number("DELTA_T")
    if period <= 0:
        raise header.wrong(f"DELTA_T is {period:g} s")
    notes: list[str] = []
    stored = _stored(header, content[header.count("NUM_HEADER_BLOCKS") * _BLOCK :])
    stored = _without_filling(header, stored, notes)
    numbers = range(1, len(stored) + 1)
    headings = tuple(named(_name(header, n), header.values.get(f"UNITS.CHAN_{n}", "")) for n in numbers)
    values = tuple(_scale(header, n) * channel.astype(float) for n, channel in zip(numbers, stored, strict=True))
    return on_one_clock([ChannelGroup("", headings, values, period * np.arange(stored.shape[1]))], notes)


def _header(shown: str, content: bytes) -> _Header:
    first = _Header(shown, _records(content[:_BLOCK]))
    if next(iter(first.values), "") != "FORMAT":
        raise first.wrong("no RPC III file, it does not begin with FORMAT")
    blocks = first.count("NUM_HEADER_BLOCKS")
    header = _Header(shown, _SILENT | _records(content[: blocks * _BLOCK]))
    if blocks * _BLOCK > len(content) or header.count("NUM_PARAMS") > blocks * 4:
        told = f"{blocks} header blocks of {_BLOCK} bytes with {header.count('NUM_PARAMS')} keywords"
        raise header.wrong(f"{told} are told, the file has {len(content)} bytes")
    for keyword, known in (("FORMAT", _ORDERS), ("FILE_TYPE", ("TIME_HISTORY",)), ("DATA_TYPE", _TYPES)):
        if header.text(keyword) not in known:
            raise header.wrong(f"{keyword} is {echo(header.text(keyword))}, not {' or '.join(known)}")
    if header.values.get("TIME_TYPE") == "PEAK_PICK":
        raise header.wrong("TIME_TYPE is PEAK_PICK: peaks without their times")
    return header


def _records(blocks: bytes) -> dict[str, str]:
    """Keywords in capitals with their values; the first of each."""
    found: dict[str, str] = {}
    for place in range(0, len(blocks) - _RECORD + 1, _RECORD):
        record = blocks[place : place + _RECORD]
        keyword = _text(record[:_KEYWORD]).upper()
        if keyword:
            found.setdefault(keyword, _text(record[_KEYWORD:]))
    return found


def _text(field: bytes) -> str:
    """A field up to its first NUL, without quotation marks around it."""
    content = field.partition(b"\0")[0]
    try:
        text = content.decode()
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    return text.strip().strip('"').strip()


def _name(header: _Header, number: int) -> str:
    return header.values.get(f"DESC.CHAN_{number}") or f"channel {number}"


def _scale(header: _Header, number: int) -> float:
    is_short = header.text("DATA_TYPE") == "SHORT_INTEGER"
    return header.number(f"SCALE.CHAN_{number}") if is_short else 1.0


def _stored(header: _Header, data: bytes) -> np.ndarray:
    """Numbers [channels, rows] as stored, of all frames that the header tells."""
    channels, frames, frame, group = map(header.count, ("CHANNELS", "FRAMES", "PTS_PER_FRAME", "PTS_PER_GROUP"))
    if group % frame:
        raise header.wrong(f"a group of {group} points is no whole number of frames of {frame}")
    kind = header.text("DATA_TYPE")
    dtype = np.dtype(_ORDERS[header.text("FORMAT")] + _TYPES[kind])
    layouts = [
        (len(data) - dtype.itemsize * channels * length, rows, length)
        for rows in (frame * (frames + header.has_half_frames), frame * frames)
        for length in (-(-rows // group) * group, rows)
    ]
    fitting = [layout for layout in layouts if 0 <= layout[0] < _BLOCK and not any(data[len(data) - layout[0] :])]
    if not fitting:
        told = f"{frames} frames of {frame} points in {channels} channels of {kind}"
        raise header.wrong(f"{told} are told, which {len(data)} bytes of data are not")
    _, rows, length = min(fitting)
    numbers = np.frombuffer(data, dtype, channels * length)
    whole = rows // group * group
    parts = numbers[: channels * whole].reshape(-1, channels, group).swapaxes(0, 1).reshape(channels, whole)
    last = numbers[channels * whole :].reshape(channels, length - whole)
    return np.concatenate((parts, last[:, : rows - whole]), axis=1)


def _without_filling(header: _Header, stored: np.ndarray, notes: list[str]) -> np.ndarray:
    """Numbers [channels, rows] less those at the end that only fill the last group, all 0 or one row again and again.

    The keyword SAMPLES, which some programs write, says how many rows there are.
    """
    rows = stored.shape[1]
    if "SAMPLES" in header.values:
        kept = min(rows, header.count("SAMPLES"))
    else:
        tail = stored[:, -header.count("PTS_PER_GROUP") - 1 :]  # longer than what can fill a group
        others = np.flatnonzero(np.any(tail != tail[:, -1:], axis=0))
        repeated = tail.shape[1] - 1 - others[-1] if others.size else 1
        kept = rows - repeated + int(not others.size or np.any(tail[:, -1]))
    if kept < rows:
        notes.append(f"left out at the end, only filling the last group: {counted(rows - kept, 'row')}")
    if header.has_half_frames:
        notes.append("HALF_FRAMES: half a frame at the beginning and one at the end, which may be no part of the test")
    return stored[:, :kept]
