"""Where a sampled curve passes a level."""

import numpy as np


def crossings(value: np.ndarray, level: float = 0.0, falling: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Intervals i [n] in which value [k] passes `level`, and at what part [n] of each, by linear interpolation.

    Interval i lies between samples i and i + 1; only those where it falls, if `falling`.
    """
    below, above = value < level, value >= level  # a NaN is neither
    passes = above[:-1] & below[1:]
    if not falling:
        passes |= below[:-1] & above[1:]
    i = np.flatnonzero(passes)
    return i, (value[i] - level) / (value[i] - value[i + 1])


def corner_frequency(f: np.ndarray, value: np.ndarray, level: float) -> float | None:
    """First frequency at which `value` falls through `level`, by interpolation over log f; None if it never does."""
    intervals, parts = crossings(value, level, falling=True)
    if not len(intervals):
        return None
    i = intervals[0]
    return float(np.exp(np.log(f[i]) + parts[0] * np.log(f[i + 1] / f[i])))
