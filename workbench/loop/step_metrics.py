"""Step metrics: one number, one function. A number that does not exist is None.

Each takes times t [k] s, the controlled signal y [k] and what it was and should become, all SI. They are of the true
signal, not of what a sensor says.
"""

import numpy as np

LAST = 0.3  # s: the end of a record, over which a loop should be at rest


def settling_time(t: np.ndarray, y: np.ndarray, target: float, band: float) -> float | None:
    """Time [s] after which y stays within +-`band` of the target; None if it leaves that in the last 0.3 s."""
    outside = np.flatnonzero(np.abs(y - target) > band)
    if not len(outside):
        return 0.0
    last = outside[-1]
    if t[last] > t[-1] - LAST:
        return None
    return float(t[last + 1] - t[0])


def overshoot(y: np.ndarray, before: float, target: float) -> float:
    """Largest excursion beyond the target, percent of the step."""
    step = target - before
    return float(max(0.0, np.max((y - target) / step)) * 100)


def peak_deviation(y: np.ndarray, target: float) -> float:
    """Largest distance of y from the target, in the unit of y."""
    return float(np.max(np.abs(y - target)))


def rise_time(t: np.ndarray, y: np.ndarray, before: float, target: float) -> float | None:
    """Time [s] from first reaching 10 % to first reaching 90 % of the step; None if it never does."""
    part = (y - before) / (target - before)
    low, high = np.flatnonzero(part >= 0.1), np.flatnonzero(part >= 0.9)
    if not len(high):
        return None
    return float(t[high[0]] - t[low[0]])


def steady_state_error(t: np.ndarray, y: np.ndarray, target: float) -> float:
    """Target less the mean of y over the last 0.3 s, in the unit of y."""
    return float(target - np.mean(y[t >= t[-1] - LAST]))


def iae(t: np.ndarray, y: np.ndarray, target: float | np.ndarray) -> float:
    """Integral of the absolute error, unit of y times s; `target` is one or [k]."""
    return float(np.trapezoid(np.abs(target - y), t))


def rms_error(y: np.ndarray, asked: np.ndarray) -> float:
    """Root mean square of what y [k] lacks of what is asked [k], in the unit of y."""
    return float(np.sqrt(np.mean((asked - y) ** 2)))


def residual_oscillation(t: np.ndarray, y: np.ndarray, size: float) -> float:
    """Peak to peak of y over the last 0.3 s about its straight line, as a part of `size` (the unit of y)."""
    late = t >= t[-1] - LAST
    line = np.polynomial.Polynomial.fit(t[late], y[late], 1)
    return float(np.ptp(y[late] - line(t[late])) / abs(size))


def saturated_time(t: np.ndarray, demanded: np.ndarray, realised: np.ndarray) -> float:
    """Time [s] in which the guard gave the drive another command than the controller demanded."""
    return float(np.sum(~np.isclose(demanded, realised, rtol=0, atol=1e-9)) * (t[1] - t[0]))


def cavitation_time(t: np.ndarray, lowest: np.ndarray) -> float:
    """Time [s] with any chamber below 0 bar absolute, where the model is invalid."""
    return float(np.sum(lowest < 0) * (t[1] - t[0]))
