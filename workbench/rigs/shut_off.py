"""A shut-off valve between servo-valve and jack, in both lines: closed by the guard on a trip, open in service.

Nothing else stops a jack whose servo-valve sticks open: no command reaches it. A rig file may declare one,

    [shut_off]
    closing_time = {value = 20, unit = "ms", source = "...", bounds = [10, 50]}
    leak = {value = 0.1, unit = "%", source = "..."}

Its opening goes down linearly over the closing time to what it lets through when closed. Open it is taken as wide
beside the lands, so that the flow of the servo-valve goes with its opening.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..base.table import ConfigTable
from .number import Number, number_entry, read_number
from .schema import SHUT_OFF


@dataclass(frozen=True)
class ShutOff:
    """Time from the trip until it is closed [s], and the share of the servo-valve's flow that it lets through then."""

    closing_time: Number
    leak: Number

    def opening(self, since: float) -> float:
        """The share of the flow that passes, so many seconds `since` the trip."""
        leak, time = self.leak.value, self.closing_time.value
        return leak if since >= time else 1 - (1 - leak) * since / time

    def table(self) -> Mapping[str, object]:
        """The table of a rig file."""
        return {"closing_time": number_entry(self.closing_time), "leak": number_entry(self.leak)}


def closing_in(seconds: float) -> ShutOff:
    """One that closes in so many seconds and leaks nothing."""
    why = "supposed"
    return ShutOff(Number("closing_time", seconds, "ms", "s", why), Number("leak", 0.0, "1", "1", why))


def read_shut_off(table: ConfigTable) -> ShutOff | None:
    """That of a rig file's table; None where it has none. Raises InputError with file and row."""
    if not len(table):
        return None
    table.allow(*SHUT_OFF)
    return ShutOff(*(read_number(table, name, spec) for name, spec in SHUT_OFF.items()))
