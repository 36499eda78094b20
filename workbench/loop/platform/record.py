"""A recorded motion along one axis of a platform, played again and again: the poses asked for are corrected by what the
inverse of the linear loop makes of the error, in all six axes."""

from dataclasses import dataclass

import numpy as np

from ...control.platform_controller import PlatformController
from ...records.road import road
from .loop import PlatformRun, run_platform
from .setup import PlatformSetup
from .transfer import platform_transfer

_REST = 0.5  # s: before and after the record
_FADE = 0.25  # s: over which it comes and goes


@dataclass(frozen=True)
class Played:
    """A record played: the true motion that is wanted [k, 6], the first and the best run, and the errors of all: RMS
    over all axes, angles times the radius of the joints, m."""

    target: np.ndarray
    first: PlatformRun
    best: PlatformRun
    errors: list[float]


def road_pose(
    setup: PlatformSetup, axis: int, kind: str, speed: float, seconds: float, band: tuple[float, float], peak: float
) -> np.ndarray:
    """Poses [k, 6]: along one axis a road of a class at a speed [m/s], scaled to a `peak` [m] at the joints, at rest
    before and after. Raises InputError as `road` does."""
    period = setup.platform.period
    t, heights = road(kind, speed, seconds, band, 0)
    at = np.arange(round(seconds / period)) * period
    shape = np.interp(at, t, heights)
    fade = np.clip(np.minimum(at, seconds - at) / _FADE, 0.0, 1.0)
    shape = (shape - shape.mean()) * fade**2 * (3 - 2 * fade)
    rest = np.zeros(round(_REST / period))
    whole = np.concatenate((rest, shape * peak / np.abs(shape).max(), rest))
    pose = np.zeros((len(whole), 6))
    pose[:, axis] = whole / setup.platform.geometry.weights[axis]
    return pose


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
