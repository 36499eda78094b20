"""Motions of a platform as poses at its control period, at rest at home before and after: roads, recorded courses and
accelerations."""

import numpy as np

from ...base.errors import InputError
from ...records.road import road
from ...rigs.platform import Platform
from ..reach import sampled_record
from .reach import check_poses

REST = 0.5  # s: before and after a motion
_FADE = 0.25  # s: over which a road comes and goes
_BACK = 0.5  # s: in which a record that ends elsewhere leads back home
_ASIDE = 1.5  # over the corner, s: before and after accelerations, where an impulse has fallen to a thousandth
_CORNERS = np.geomspace(0.1, 5.0, 40)  # Hz
_STROKE = 0.95  # of the legs, that accelerations may take


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
    """Poses [k, 6] of a record: deviations of its values [n, 6] from the first at rising times t [n] s; then back
    home."""
    course = _sampled(platform, t, values - values[0])
    fall = 0.5 + 0.5 * np.cos(np.pi * np.arange(1, round(_BACK / platform.period) + 1) * platform.period / _BACK)
    rest = np.zeros((round(REST / platform.period), 6))
    return np.vstack((rest, course, fall[:, None] * course[-1], rest))


def accelerated_pose(platform: Platform, t: np.ndarray, values: np.ndarray, corner: float) -> np.ndarray:
    """Poses [k, 6] whose accelerations are the values [n, 6] at rising times t [n] s, in m/s2 and rad/s2, above a
    corner [Hz]: integrated twice behind f^4/(f^4 + corner^4), without phase. They leave home before the record begins,
    and come back after it."""
    period = platform.period
    course, aside = _sampled(platform, t, values), round(_ASIDE / corner / period)
    whole = np.pad(course, ((2 * aside, 2 * aside), (0, 0)))
    f = np.fft.rfftfreq(len(whole), period)[:, None]
    twice = -(f**2) / (f**4 + corner**4) / (2 * np.pi) ** 2
    pose = np.fft.irfft(twice * np.fft.rfft(whole, axis=0), len(whole), axis=0)[aside:-aside]
    at = np.arange(len(pose)) * period
    fade = np.clip(np.minimum(at, at[::-1]) / _FADE, 0.0, 1.0)[:, None]
    rest = np.zeros((round(REST / period), 6))
    return np.vstack((rest, pose * fade**2 * (3 - 2 * fade), rest))


def lowest_corner(platform: Platform, t: np.ndarray, values: np.ndarray) -> float:
    """The lowest corner [Hz] above which the legs have the stroke for accelerations [n, 6]. Raises InputError where
    they have it at none."""
    for corner in _CORNERS:
        if check_poses(platform, accelerated_pose(platform, t, values, corner)).stroke.max() < _STROKE:
            return float(corner)
    raise InputError(
        f"its accelerations above {_CORNERS[-1]:g} Hz still take more than the stroke of the legs; scale it"
    )


def _sampled(platform: Platform, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values [k, 6] at the control period, without what is above its Nyquist frequency; by cubic splines from rest to
    rest between slower samples."""
    from scipy.interpolate import CubicSpline

    period = platform.period
    at = np.arange(int((t[-1] - t[0]) / period + 1e-6) + 1) * period
    records = [sampled_record(t, course, period) for course in values.T]
    splines = [CubicSpline(record.t, record.values, bc_type="clamped") for record in records]
    return values[0] + np.column_stack([spline(np.minimum(at, spline.x[-1])) for spline in splines])
