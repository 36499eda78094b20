"""A grid of instants that a loop keeps, how late it is there, and what this machine misses by itself."""

import ctypes
import sys
import time

import numpy as np

_BINS = 100_000  # microseconds: later is in the last
_LOST = 1_000_000_000  # ns behind, from where on a new grid begins
_TIMER_SLACK = 29  # of prctl


class Times:
    """A histogram of times, by the microsecond."""

    def __init__(self) -> None:
        self._counts = [0] * _BINS  # numbers of Python's own: numpy's are slow

    def add(self, ns: int) -> None:
        """One more time [ns]."""
        self._counts[min(max(ns // 1000, 0), _BINS - 1)] += 1

    @property
    def counts(self) -> np.ndarray:
        """How often a time was so many microseconds."""
        return np.array(self._counts)


class Pace:
    """Instants every `period` [s], the next one `due` [ns] of the performance counter.

    `late`: by how much instants were met late, `worst` [ns] and `missed`: how often by a period.
    """

    def __init__(self, period: float) -> None:
        self.period = round(1e9 * period)
        self.late, self.worst, self.missed, self.due = Times(), 0, 0, 0

    def start(self) -> None:
        """The first instant is a period from now; this thread wakes up when it asks to, where Linux would else bundle
        wake-ups (50 us)."""
        if sys.platform == "linux":
            ctypes.CDLL(None).prctl(_TIMER_SLACK, 1, 0, 0, 0)
        self.due = time.perf_counter_ns() + self.period

    def left(self) -> float:
        """Time [s] until the next instant."""
        return 1e-9 * (self.due - time.perf_counter_ns())

    def meet(self) -> None:
        """It is met now."""
        late = time.perf_counter_ns() - self.due
        self.late.add(late)
        if late > self.worst:
            self.worst = late
        self.missed += late >= self.period

    def go_on(self) -> None:
        """To the next instant."""
        now, self.due = time.perf_counter_ns(), self.due + self.period
        if now - self.due > _LOST:
            self.due = now + self.period


def idle_pace(rate: float, seconds: float) -> Pace:
    """An empty loop at a rate [Hz] for so long: what a service is held against."""
    pace = Pace(1 / rate)
    pace.start()
    for _ in range(max(1, round(rate * seconds))):
        while (left := pace.left()) > 0:
            time.sleep(left)
        pace.meet()
        pace.go_on()
    return pace
