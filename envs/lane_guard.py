"""The limits of workbench.loop.guard over N lanes at once, without its brake, observer and repeated readings.

An episode ends at a limit, and its sensors have no faults.
"""

from enum import IntEnum
from math import isfinite

import numpy as np

from workbench.loop.guard_numbers import max_move_per_period
from workbench.loop.sampled_loop import SIMULATION_FAILED
from workbench.rigs.rig import Rig


class Trip(IntEnum):
    """Why an episode ended before its time."""

    NONE = 0
    SIGNAL = 1
    STROKE = 2
    SPEED = 3
    FORCE = 4
    ACTION = 5
    END_STOP = 6
    SIMULATION = 7

    @property
    def reason(self) -> str:
        """In words."""
        return _REASONS[self]


_REASONS = (
    "",
    "a signal is not finite",
    "position beyond the rig's stroke limit",
    "speed above the rig's limit",
    "force above the rig's limit",
    "the action is not finite",
    "the jack met its end stop",
    SIMULATION_FAILED,
)


class LaneGuard:
    """Limits N commands to +-1 and to the rig's rate; trips a lane, with `trip` [N] saying why, when it leaves limits.

    A trip latches until the lane's reset: its command goes to 0 at the allowed rate. `command` [N] is what the drives
    hold, `change` [N] what the last `limit` added to it; both are replaced, never changed in place. `before` [N] is
    the measured position of one period ago.
    """

    def __init__(self, rig: Rig, names: tuple[str, ...], lanes: int) -> None:
        period = rig.period.value
        self.position = position = names.index("position")
        watched = [(position, rig["xmid"], rig.limit("stroke")), (position, np.nan, max_move_per_period(rig))]
        if "force" in names:
            watched.append((names.index("force"), 0.0, rig.limit("force")))
        columns, zeros, limits = zip(*watched, strict=True)
        self._columns, self._limits = np.array(columns), np.tile(np.array(limits), (lanes, 1))
        self._zero = np.tile(np.array(zeros), (lanes, 1))
        self.before = self._zero[:, 1]  # the second column is the position of one period ago
        self._most = np.array(rig.limit("command_rate") * period)
        self._least = -self._most
        self._change = rig.limit("command_rate") * period
        self._bounds = (rig["xmid"], rig.limit("stroke"), max_move_per_period(rig))
        self._load, self._force = (names.index("force") if "force" in names else None), rig.limit("force")
        self.command, self.change = np.zeros(lanes), np.zeros(lanes)
        self.trip = np.zeros(lanes, dtype=np.int8)
        self.any_tripped = False

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__ |= state
        self.before = self._zero[:, 1]  # a view, which a copy of it is not

    def reset(self, rows: np.ndarray, command: float) -> None:
        """Forget the past of some lanes, whose drives hold `command` [1]."""
        self.command = self.command.copy()
        self.command[rows] = command
        self.before[rows] = np.nan  # compares as "not too fast", like no position at all
        self.trip[rows] = Trip.NONE
        self.any_tripped = bool(np.count_nonzero(self.trip))

    def watch(self, measured: np.ndarray) -> None:
        """Trip the lanes whose signals [N, names] (SI) are not finite or beyond the rig's limits."""
        signals = measured.take(self._columns, 1)
        beyond = np.abs(signals - self._zero) > self._limits
        if np.count_nonzero(beyond) or not _all_finite(measured):
            self._judge(beyond, np.logical_and.reduce(np.isfinite(measured), axis=1))
        np.copyto(self.before, signals[:, 0])

    def limit(self, demanded: np.ndarray) -> np.ndarray:
        """The commands [N] that the drives get for the demanded ones: limited in size and rate, safe after a trip."""
        if not _all_finite(demanded):
            self.end(~np.isfinite(demanded), Trip.ACTION)
        change = np.fmax(demanded, _LOW)
        np.fmin(change, _HIGH, change)
        if self.any_tripped:
            change[self.trip != Trip.NONE] = 0.0
        np.subtract(change, self.command, change)
        np.fmax(change, self._least, change)
        np.fmin(change, self._most, change)
        self.change, self.command = change, self.command + change
        return self.command

    def change_of(self, demanded: float, command: float) -> float:
        """What `limit` adds to the command of a lane that has not tripped, for a finite demand."""
        most = self._change
        return min(max(min(max(demanded, -1.0), 1.0) - command, -most), most)

    def passes(self, measured: list[float], before: float) -> bool:
        """Whether `watch` finds nothing wrong with the signals [names] of a lane, for certain."""
        middle, stroke, speed = self._bounds
        position = measured[self.position]
        return (
            isfinite(sum(measured))
            and abs(position - middle) <= stroke
            and abs(position - before) <= speed
            and (self._load is None or abs(measured[self._load]) <= self._force)
        )

    def end(self, lanes: np.ndarray, why: Trip) -> None:
        """Trip the lanes of a mask [N] that have not tripped before."""
        self.trip[lanes & (self.trip == Trip.NONE)] = why
        self.any_tripped = bool(np.count_nonzero(self.trip))

    def _judge(self, beyond: np.ndarray, finite: np.ndarray) -> None:
        """The first reason that holds counts."""
        self.end(~finite, Trip.SIGNAL)
        for column, why in zip(beyond.T, (Trip.STROKE, Trip.SPEED, Trip.FORCE), strict=False):
            self.end(column, why)


_LOW, _HIGH = np.array(-1.0), np.array(1.0)


def _all_finite(values: np.ndarray) -> bool:
    return np.count_nonzero(np.isfinite(values)) == values.size
