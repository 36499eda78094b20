"""A drive whose commands arrive late: the one place where a delay becomes commands that a plant holds."""

from collections import deque
from dataclasses import dataclass

import numpy as np

_SHORT = 1e-6  # of a period: the least part over which the older command is held where lanes differ


def periods(delay: float, period: float) -> tuple[int, float]:
    """A delay [s] as whole periods [s] and the part of one that is left over, 0 <= part < 1.

    A part within 1e-9 of a whole period is rounding.
    """
    whole = int(delay / period + 1e-9)
    part = delay / period - whole
    return whole, part if part > 1e-9 else 0.0


@dataclass(frozen=True)
class LaneDelays:
    """Delays of lanes as whole periods [lanes] and parts of one [lanes]."""

    whole: np.ndarray
    part: np.ndarray

    @classmethod
    def of(cls, delays: np.ndarray, period: float) -> "LaneDelays":
        """Of delays [lanes] in s."""
        pairs = [periods(delay, period) for delay in delays.tolist()]
        return cls(np.array([whole for whole, _ in pairs]), np.array([part for _, part in pairs]))

    @property
    def differ(self) -> bool:
        """Whether not all lanes have one delay."""
        return bool(np.ptp(self.whole) or np.ptp(self.part))

    @property
    def taps(self) -> np.ndarray:
        """[lanes, longest + 1]: 1 at the number of periods by which a lane's command is late, else 0."""
        return np.eye(self.whole.max() + 1)[self.whole]

    def durations(self, period: float) -> np.ndarray:
        """How long [s] a lane holds the older and the newer command in a period, [lanes, 2]; neither is ever 0."""
        part = np.clip(self.part, _SHORT, 1 - _SHORT)
        return np.stack((part, 1 - part), axis=1) * period


class DelayLine:
    """The commands on their way to a plant that gets each of them `delay` s after it was sent, one every `period` s.

    `command` is the one that has been sent for ever. Where the delay is no whole number of periods, the command that
    the plant holds goes over to the next one inside the period (Franklin, Powell, Workman, Digital Control of Dynamic
    Systems, 3rd ed. 1998, ch. 4: systems with delay); where it is `interpolated`, it holds their mean instead.
    """

    def __init__(self, delay: float, period: float, command: float, interpolated: bool = False) -> None:
        whole, self._part = periods(delay, period)
        self._interpolated = interpolated
        self._sent = deque([command] * (whole + 1), whole + 2)

    def send(self, command: float) -> tuple[tuple[float, float], ...]:
        """What the plant holds over the period that begins now: commands, and the share of the period of each."""
        self._sent.append(command)
        before = self._sent.popleft()
        now = self._sent[0]
        if self._interpolated:
            return ((self._part * before + (1 - self._part) * now, 1.0),)
        return ((before, self._part), (now, 1 - self._part)) if self._part else ((now, 1.0),)
