"""The datagrams of the link between a rig and whoever commands it: little-endian, SI, seven bytes and a body.

    JBRIG  version u8  kind u8  body

Kinds: 0 hello of a client (its token), 1 hello of a rig (JSON), 2 command (sequence u32, f64 each), 3 reading (status
u8, sequence u32, tick u64, f64 each), 4 switch (u8), 5 state (text), 6 refusal (text).
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

MAGIC = b"JBRIG\x01"
HELLO, RIG, COMMAND, READING, SWITCH, STATE, REFUSAL = range(7)
OFF, ON, RESET = range(3)  # what a switch asks for
STATES = ("off", "on", "tripped")
LARGEST = 65507  # bytes of a datagram
_HEAD = len(MAGIC) + 1
_COMMAND, _READING = struct.Struct("<I"), struct.Struct("<BIQ")

IS_ON, IS_TRIPPED, WATCHDOG, LATE, LIMITED = 1, 2, 4, 8, 16
"""Bits of a reading's status."""


@dataclass(frozen=True)
class Reading:
    """What a rig's sensors say at a tick, SI, in the order of its hello; `sequence` of the command last applied."""

    status: int
    sequence: int
    tick: int
    values: tuple[float, ...]

    @property
    def tripped(self) -> bool:
        """Whether the rig has tripped."""
        return bool(self.status & IS_TRIPPED)

    @property
    def watchdog(self) -> bool:
        """Whether its watchdog has fired: the command is 0."""
        return bool(self.status & WATCHDOG)


def datagram(kind: int, body: bytes = b"") -> bytes:
    """One of a kind."""
    return MAGIC + bytes([kind]) + body


def opened(data: bytes) -> tuple[int, bytes] | None:
    """Kind and body; None for what is no datagram of the link."""
    if len(data) < _HEAD or not data.startswith(MAGIC):
        return None
    return data[_HEAD - 1], data[_HEAD:]


def command(sequence: int, values: Sequence[float]) -> bytes:
    """A client's commands."""
    return datagram(COMMAND, struct.pack(f"<I{len(values)}d", sequence, *values))


def read_command(body: bytes) -> tuple[int, tuple[float, ...]] | None:
    """Sequence and values of a command; None for a body that has another form."""
    values = _values(body, _COMMAND.size)
    return None if values is None else (_COMMAND.unpack_from(body)[0], values)


def reading(each: Reading) -> bytes:
    """A rig's reading."""
    head = _READING.pack(each.status, each.sequence, each.tick)
    return datagram(READING, head + struct.pack(f"<{len(each.values)}d", *each.values))


def write_head(data: bytearray, status: int, sequence: int, tick: int) -> None:
    """Put these into a reading."""
    _READING.pack_into(data, _HEAD, status, sequence, tick)


def read_reading(body: bytes) -> Reading | None:
    """The reading in a body; None for one that has another form."""
    values = _values(body, _READING.size)
    if values is None:
        return None
    status, sequence, tick = _READING.unpack_from(body)
    return Reading(status, sequence, tick, values)


def _values(body: bytes, head: int) -> tuple[float, ...] | None:
    """The numbers behind so many bytes; None where there is no whole number of them."""
    count, rest = divmod(len(body) - head, 8)
    return struct.unpack_from(f"<{count}d", body, head) if count >= 0 and not rest else None
