"""Motions of a platform as poses at its control period, at rest at home before and after: roads, recorded courses."""

import numpy as np

from ...records.road import road
from ...rigs.platform import Platform
from ..own_references import sampled_record

REST = 0.5  # s: before and after a motion
_FADE = 0.25  # s: over which a road comes and goes
_BACK = 0.5  # s: in which a record that ends elsewhere leads back home


def road_pose(
    platform: Platform, axis: int, kind: str, speed: float, seconds: float, band: tuple[float, float], peak: float
) -> np.ndarray:
    """Poses [k, 6]: along one axis a road of a class at a speed [m/s], scaled to a `peak` [m] at the joints. Raises
    InputError as `road` does."""
    period = platform.period
    t, heights = road(kind, speed, seconds, band, 0)
    at = np.arange(round(seconds / period)) * period
    shape = np.interp(at, t, heights)
    fade = np.clip(np.minimum(at, seconds - at) / _FADE, 0.0, 1.0)
    shape = (shape - shape.mean()) * fade**2 * (3 - 2 * fade)
    rest = np.zeros(round(REST / period))
    whole = np.concatenate((rest, shape * peak / np.abs(shape).max(), rest))
    pose = np.zeros((len(whole), 6))
    pose[:, axis] = whole / platform.geometry.weights[axis]
    return pose


def recorded_pose(platform: Platform, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Poses [k, 6] of a record: deviations of its values [n, 6] from the first at rising times t [n] s, without what is
    above the control's Nyquist frequency, by cubic splines from rest to rest between slower samples; then back home."""
    from scipy.interpolate import CubicSpline

    period = platform.period
    at = np.arange(int((t[-1] - t[0]) / period + 1e-6) + 1) * period
    records = [sampled_record(t, course, period) for course in values.T]
    splines = [CubicSpline(record.t, record.values, bc_type="clamped") for record in records]
    course = np.column_stack([spline(np.minimum(at, spline.x[-1])) for spline in splines])
    fall = 0.5 + 0.5 * np.cos(np.pi * np.arange(1, round(_BACK / period) + 1) * period / _BACK)
    rest = np.zeros((round(REST / period), 6))
    return np.vstack((rest, course, fall[:, None] * course[-1], rest))
