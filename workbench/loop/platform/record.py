"""Motions of a platform as poses at its control period, at rest at home before and after (roads, recorded courses and
accelerations), checked; and a recorded one played again and again: the poses asked for are corrected by what the
inverse of the linear loop makes of the error, in all six axes.
"""

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import PlatformController
from ...records.road import road
from ...rigs.platform import Platform, leg_lengths
from ..capability import capability
from ..reach import sampled_record
from .loop import PlatformRun, run_platform
from .reach import MOST_CONDITION, check_poses, most_force, static_forces
from .setup import PlatformSetup
from .transfer import platform_transfer

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


@dataclass(frozen=True)
class Played:
    """A record played: the true motion that is wanted [k, 6], the first and the best run, and the errors of all: RMS
    over all axes, angles times the radius of the joints, m."""

    target: np.ndarray
    first: PlatformRun
    best: PlatformRun
    errors: list[float]


def check_motion(setup: PlatformSetup, pose: np.ndarray) -> None:
    """Raises InputError where poses [k, 6] lead a leg beyond its stroke, joint angles, speed, force or flow, or near a
    singular pose. Forces: gravity, and the masses at home; the speed at full command falls with the root of the
    pressure that a driving force leaves, (v/v0)^2 + F/F0 = 1 (Merritt, Hydraulic Control Systems, 1967, ch. 5)."""
    platform, check = setup.platform, check_poses(setup.platform, pose)
    speed = np.gradient(leg_lengths(platform.geometry, pose), platform.period, axis=0)
    mass = np.linalg.inv((setup.directions / setup.masses) @ setup.directions.T)
    force = static_forces(platform, pose) + np.gradient(speed, platform.period, axis=0) @ mass
    share = force / most_force(platform)
    full = np.array([jack.v0 for jack in platform.of_rigs(capability)])
    uses = {
        "stroke": check.stroke,
        "angle of the base joint": check.base_angle,
        "angle of the platform joint": check.platform_angle,
        "speed": np.abs(speed) / platform.limits("speed"),
        "force": np.abs(share),
        "flow": (speed / full) ** 2 + np.maximum(share * np.sign(speed), 0.0),
        "condition of the Jacobian": check.condition[:, None] / MOST_CONDITION,
    }
    for name, use in uses.items():
        if use.max() > 1:
            row, leg = np.unravel_index(np.argmax(use), use.shape)
            where = f"{name} at {row * platform.period - REST:.3f} s"
            of = f"leg {leg + 1}, {where}" if use.shape[1] > 1 else where
            raise InputError(f"record: {of}: {100 * use.max():.4g} % of its limit; play it smaller or slower")


def play(
    setup: PlatformSetup,
    controller: PlatformController,
    target: np.ndarray,
    highest: float,
    iterations: int,
    seed: int | None = None,
) -> Played:
    """Play poses [k, 6], then correct and play them again `iterations` times, below the `highest` frequency [Hz]; stops
    where a run trips."""
    inverse, weights = _inverse(setup, controller, len(target), highest), setup.platform.geometry.weights
    asked, runs, errors = target, [run_platform(setup, controller, target, seed)], []
    while runs[-1].tripped is None and len(errors) <= iterations:
        error = target - runs[-1].pose
        errors.append(float(np.sqrt(np.mean((error * weights) ** 2))))
        asked = asked + _corrected(inverse, error)
        runs.append(run_platform(setup, controller, asked, seed))
    return Played(target, runs[0], runs[int(np.argmin(errors)) if errors else 0], errors)


def _corrected(inverse: np.ndarray, error: np.ndarray) -> np.ndarray:
    """What is added to the poses asked for [k, 6]."""
    lines = np.fft.rfft(error, axis=0)
    lines[len(inverse) :] = 0.0
    lines[: len(inverse)] = (inverse @ lines[: len(inverse), :, None])[..., 0]
    return np.fft.irfft(lines, len(error), axis=0)


def _inverse(setup: PlatformSetup, controller: PlatformController, samples: int, highest: float) -> np.ndarray:
    """From an error to a correction of what is asked for [lines, 6, 6], of the lines of a spectrum up to a frequency
    [Hz], faded out over its last third."""
    weights = setup.platform.geometry.weights
    f = np.arange(1, int(highest * samples * setup.platform.period) + 1) / (samples * setup.platform.period)
    transfer = platform_transfer(setup, controller, f).transfer * weights / weights[:, None]
    fade = np.clip(3 * (1 - f / highest), 0.0, 1.0)
    inverses = np.linalg.inv(transfer) * fade[:, None, None]
    return np.concatenate((np.eye(6)[None], inverses))
