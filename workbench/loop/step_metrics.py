"""Step metrics: one number, one function. A number that does not exist is None, or NaN in lanes.

Each takes times t [k] s, the controlled signal y [k], or of loops in lanes [lanes, k], and what it was and should
become, all SI. They are of the true signal, not of what a sensor says.
"""

import numpy as np

from ..rigs.oil import CAVITATES

LAST = 0.3  # s: the end of a record, over which a loop should be at rest
_SUSTAINED = 0.8  # of the swing before: an oscillation that stays


def settling_times(t: np.ndarray, y: np.ndarray, target: np.ndarray, band: float) -> np.ndarray:
    """Times [lanes] s after which lanes stay within +-`band` of their targets [lanes]; NaN of one that leaves that in
    the last 0.3 s, or has NaN anywhere."""
    outside = np.abs(y - target[:, None]) > band
    last = len(t) - 1 - np.argmax(outside[:, ::-1], axis=1)
    settled = np.where(outside.any(axis=1), t[np.minimum(last + 1, len(t) - 1)] - t[0], 0.0)
    late = outside.any(axis=1) & (t[last] > t[-1] - LAST)
    return np.where(late | np.isnan(y).any(axis=1), np.nan, settled)


def settling_time(t: np.ndarray, y: np.ndarray, target: float, band: float) -> float | None:
    """Time [s] after which y stays within +-`band` of the target; None if it leaves that in the last 0.3 s."""
    (settled,) = settling_times(t, y[None], np.array([target]), band).tolist()
    return None if np.isnan(settled) else settled


def overshoots(y: np.ndarray, target: np.ndarray, step: float) -> np.ndarray:
    """Largest excursions [lanes] beyond targets [lanes], percent of the step."""
    return np.maximum(np.max((y - target[:, None]) / step, axis=1), 0.0) * 100


def overshoot(y: np.ndarray, before: float, target: float) -> float:
    """Largest excursion beyond the target, percent of the step."""
    return float(overshoots(y[None], np.array([target]), target - before)[0])


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


def hunting_lanes(period: float, y: np.ndarray, size: float, share: float) -> np.ndarray:
    """Which lanes of y [lanes, k], without noise, swing by more than `share` of the step in the last 0.3 s: bool.

    About a parabola, so that a slow loop that is still on its way does not count; and by four fifths of the 0.3 s
    before at least, so that a mode that is dying away does not.
    """
    last = round(LAST / period)
    now, before = _ripple(y[:, -last:], 2), _ripple(y[:, -2 * last : -last], 2)
    return (now > share * abs(size)) & (now > _SUSTAINED * before)


def _ripple(y: np.ndarray, degree: int) -> np.ndarray:
    """Peak to peak of y [lanes, k] about its polynomial of a degree."""
    basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, y.shape[1]), degree + 1))[0]
    return np.ptp(y - (y @ basis) @ basis.T, axis=1)


def saturated_time(t: np.ndarray, demanded: np.ndarray, realised: np.ndarray) -> float:
    """Time [s] in which the guard gave the drive another command than the controller demanded."""
    return float(np.sum(~np.isclose(demanded, realised, rtol=0, atol=1e-9)) * (t[1] - t[0]))


def cavitation_time(t: np.ndarray, lowest: np.ndarray) -> float:
    """Time [s] with gas in any chamber, of its lowest pressure [k] Pa, absolute, at t [k] s."""
    return float((lowest < CAVITATES) @ np.gradient(t))
