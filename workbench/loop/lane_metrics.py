"""Step metrics of many loops at once: those of step_metrics, lane by lane, NaN where a number does not exist."""

from dataclasses import dataclass

import numpy as np

from .step_metrics import LAST

_SUSTAINED = 0.8  # of the swing before: an oscillation that stays


@dataclass(frozen=True)
class StepLanes:
    """Of steps of one size [SI] in lanes: settling [s], overshoot [%], residual oscillation [part of the step]."""

    settling: np.ndarray
    overshoot: np.ndarray
    oscillation: np.ndarray


def step_lanes(period: float, y: np.ndarray, before: np.ndarray, size: float, band: float) -> StepLanes:
    """Metrics of y [lanes, k] after a step from `before` [lanes], settled within +-`band` (SI) of its end.

    As in step_metrics, a lane that leaves the band in the last 0.3 s has no settling time.
    """
    error = y - (before + size)[:, None]
    outside = np.abs(error) > band
    k = y.shape[1]
    last = np.where(outside.any(axis=1), k - 1 - np.argmax(outside[:, ::-1], axis=1), -1)
    settling = np.where(last * period > (k - 1) * period - LAST, np.nan, (last + 1) * period)
    overshoot = np.maximum(np.max(error / size, axis=1), 0.0) * 100
    late = y[:, np.arange(k) * period >= (k - 1) * period - LAST]
    return StepLanes(np.where(np.isnan(y).any(axis=1), np.nan, settling), overshoot, _ripple(late, 1) / abs(size))


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
