"""What this machine's clock does by itself: an empty loop on the grid of a rate, against which a service is held."""

import ctypes
import time
from dataclasses import dataclass

import numpy as np

from .machine_code import LinkJob, exact_timers, rig_code, set_addresses

_BINS = 100_000  # microseconds: later is in the last


@dataclass(frozen=True)
class IdleClock:
    """How often an empty loop woke up so many microseconds late, the worst [us], and how often by a whole period."""

    counts: np.ndarray
    worst_us: float
    missed: int
    periods: int


def idle_clock(rate: float, seconds: float) -> IdleClock:
    """An empty loop at a rate [Hz] for so long. Raises OSError or RuntimeError where this machine cannot compile."""
    code, job, counts = rig_code(), LinkJob(), np.zeros(_BINS, np.int64)
    set_addresses(job, jitter=counts)
    periods = max(1, round(rate * seconds))
    job.jitter_bins, job.period_ns, job.readings = _BINS, round(1e9 / rate), periods
    job.clock_id = time.CLOCK_MONOTONIC
    exact_timers()
    job.due = time.monotonic_ns() + job.period_ns
    code.idle(ctypes.addressof(job))
    return IdleClock(counts, job.worst / 1e3, job.missed, periods)
