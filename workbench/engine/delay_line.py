"""A drive whose commands arrive late: the one place where a delay becomes commands that a plant holds.

Where the delay is no whole number of periods, the command that the plant holds goes over to the next one inside the
period (Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 4: systems with delay). A loop
asks period by period (`DelayLine`), lanes all at once (`LaneDelays`), a recording row by row (`held_commands`).
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from ..rigs.sampling import arriving

Command = TypeVar("Command", float, np.ndarray)
Arriving = tuple[tuple[Command, float], ...]  # each with the share of the period for which it is held
_SHORT = 1e-6  # of a period: the least part over which the older command is held where lanes differ


def periods(delay: float, period: float) -> tuple[int, float]:
    """A delay [s] as whole periods [s] and the part of one that is left over, 0 <= part < 1.

    A part within 1e-9 of a whole period is rounding.
    """
    whole = int(delay / period + 1e-9)
    part = delay / period - whole
    return whole, part if part > 1e-9 else 0.0


@dataclass(frozen=True, eq=False)
class HeldCommands:
    """What a plant holds in the rows of a recording: the `older` command for a `share` of each row's `interval` [s],
    the `newer` one for the rest. `now` is the one that answers at the row's own moment. Arrays of one shape
    [..., rows].

    Where a drive interpolates, it holds their mean over the whole interval, and that answers.
    """

    older: np.ndarray
    newer: np.ndarray
    share: np.ndarray
    interval: np.ndarray
    now: np.ndarray
    interpolated: bool = False

    @property
    def mean(self) -> np.ndarray:
        """The mean command over each interval."""
        return arriving(self.older, self.newer, self.share, True)[0]

    @property
    def slope(self) -> np.ndarray:
        """Derivative of the mean with respect to the delay [1/s]."""
        return (self.older - self.newer) / self.interval

    @property
    def switches(self) -> bool:
        """Whether the command changes inside an interval."""
        return not self.interpolated and bool(np.any(self.share))

    def some(self, which: slice | np.ndarray) -> "HeldCommands":
        """The commands of a part of the first axis."""
        return self._each(lambda values: values[which])

    def parts(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times [..., 2 k + 1] of rows and switches between times t [..., k + 1], and the commands [..., 2 k] held
        from each on. No part has no length: a command that came with the row is held older for a millionth."""
        rows = t.shape[-1] - 1
        share = np.clip(self.share[..., :rows], _SHORT, 1 - _SHORT)
        split, held = np.empty((*t.shape[:-1], 2 * rows + 1)), np.empty((*t.shape[:-1], 2 * rows))
        split[..., ::2], split[..., 1::2] = t, t[..., :-1] + share * np.diff(t)
        held[..., ::2], held[..., 1::2] = self.older[..., :rows], self.newer[..., :rows]
        return split, held

    def paces(self, t: np.ndarray) -> np.ndarray:
        """By how much faster time goes in each part of `parts` [..., 2 k] per second that the delay grows [1/s]: the
        older command is held longer, the newer one less. 0 where both are the same."""
        split, _ = self.parts(t)
        pace = np.ones_like(split[..., 1:]) / np.diff(split)
        pace[..., 1::2] *= -1
        differ = (self.older != self.newer)[..., : t.shape[-1] - 1]
        return np.where(np.repeat(differ, 2, axis=-1), pace, 0.0)

    def _each(self, change: Callable[[np.ndarray], np.ndarray]) -> "HeldCommands":
        return _put_together([self], lambda values: change(values[0]))


def _put_together(held: Sequence[HeldCommands], put: Callable[[list[np.ndarray]], np.ndarray]) -> HeldCommands:
    """Several as one: `put` takes the same array of each."""
    return HeldCommands(
        put([each.older for each in held]),
        put([each.newer for each in held]),
        put([each.share for each in held]),
        put([each.interval for each in held]),
        put([each.now for each in held]),
        held[0].interpolated,
    )


def stacked(held: Sequence[HeldCommands]) -> HeldCommands:
    """Several of as many rows [rows], one beside the other [several, rows]."""
    return _put_together(held, np.array)


def joined(held: Sequence[HeldCommands]) -> HeldCommands:
    """Several as one, along the first axis."""
    return _put_together(held, np.concatenate)


def held_commands(edges: np.ndarray, command: np.ndarray, delay: float, interpolated: bool = False) -> HeldCommands:
    """What a plant holds between `edges` [rows + 1] (s) of the `command` [rows] sent at the first of each interval,
    `delay` s late; the first one had been sent for ever.

    Where a clock jitters so that more than two commands meet in an interval, the middle ones are left out.
    """
    interval = np.diff(edges)
    near = 1e-9 * float(np.median(interval))  # a part of a period within that is rounding
    arrives = edges[:-1] + delay
    last = np.searchsorted(arrives, edges[1:] - near, "left") - 1
    arrived = np.searchsorted(arrives, edges[:-1] + near, "right") - 1
    older, newer, now = (command[np.maximum(place, 0)] for place in (last - 1, last, arrived))
    share = np.where(last > arrived, (arrives[np.maximum(last, 0)] - edges[:-1]) / interval, 0.0)
    held = HeldCommands(older, newer, np.clip(share, 0.0, 1.0), interval, now, interpolated)
    return replace(held, now=held.mean) if interpolated else held


@dataclass(frozen=True)
class LaneDelays:
    """Delays of lanes as whole periods [lanes] and parts of one [lanes]."""

    whole: np.ndarray
    part: np.ndarray

    @classmethod
    def of(cls, delays: np.ndarray, period: float) -> "LaneDelays":
        """The whole periods and parts of delays [lanes] in s."""
        pairs = [periods(delay, period) for delay in delays.tolist()]
        return cls(np.array([whole for whole, _ in pairs]), np.array([part for _, part in pairs]))

    @property
    def differ(self) -> bool:
        """Whether not all lanes have one delay."""
        return bool(np.ptp(self.whole) or np.ptp(self.part))

    def taps(self, longest: int) -> np.ndarray:
        """[lanes, longest + 1]: 1 at the number of periods by which a lane's command is late, else 0."""
        return np.eye(longest + 1)[self.whole]

    def durations(self, period: float) -> np.ndarray:
        """How long [s] a lane holds the older and the newer command in a period, [lanes, 2]; neither is ever 0."""
        part = np.clip(self.part, _SHORT, 1 - _SHORT)
        return np.stack((part, 1 - part), axis=1) * period


class DelayLine(Generic[Command]):
    """The commands on their way to a plant that gets each of them `delay` s after it was sent, one every `period` s.

    `command`, a number or [m] of several drives, is the one that has been sent for ever. Where the line is
    `interpolated`, the plant holds the mean of the commands that arrive in a period.
    """

    def __init__(self, delay: float, period: float, command: Command, interpolated: bool = False) -> None:
        whole, self._part = periods(delay, period)
        self._interpolated = interpolated
        self._sent = deque([command] * (whole + 1), whole + 2)

    def send(self, command: Command) -> "Arriving[Command]":
        """What the plant holds over the period that begins now: commands, and the share of the period of each."""
        self._sent.append(command)
        before = self._sent.popleft()
        now = self._sent[0]
        first, last = arriving(before, now, self._part, self._interpolated)
        is_held = self._interpolated or not self._part
        return ((last, 1.0),) if is_held else ((first, self._part), (last, 1 - self._part))
