"""A recorded motion of a platform, checked, and played again and again: the poses asked for are corrected by what the
inverse of the linear loop makes of the error, in all six axes."""

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import PlatformController
from ...rigs.platform import leg_lengths
from ..capability import capability
from .loop import PlatformRun, run_platform
from .poses import REST
from .reach import MOST_CONDITION, check_poses, most_force, static_forces
from .setup import PlatformSetup
from .transfer import platform_transfer


@dataclass(frozen=True)
class PlayedRecord:
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
) -> PlayedRecord:
    """Play poses [k, 6], then correct and play them again `iterations` times, below the `highest` frequency [Hz]; stops
    where a run trips."""
    inverse, weights = _inverse(setup, controller, len(target), highest), setup.platform.geometry.weights
    asked, runs, errors = target, [run_platform(setup, controller, target, seed)], []
    while runs[-1].tripped is None and len(errors) <= iterations:
        error = target - runs[-1].pose
        errors.append(float(np.sqrt(np.mean((error * weights) ** 2))))
        asked = asked + _corrected(inverse, error)
        runs.append(run_platform(setup, controller, asked, seed))
    return PlayedRecord(target, runs[0], runs[int(np.argmin(errors)) if errors else 0], errors)


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
