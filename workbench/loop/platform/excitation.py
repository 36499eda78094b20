"""Motions that tell the six axes of a platform apart, as large as its legs take them, and what plays them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import LEGS, Forward, PlatformSpec
from ...rigs.oil import CAVITATES
from ...rigs.platform import AXES, Platform
from ..capability import capability
from ..drive_simulation import drive
from .loop import PlatformRun, run_platform
from .poses import REST
from .record import check_motion
from .setup import PlatformSetup

T = TypeVar("T")
_FADE = 0.25  # s: over which a motion comes and goes
_LARGEST, _SMALLER, _TRIES = 0.1, 0.7, 20  # m at the joints; times; sizes that are tried
_INSTANT = 1e4  # Hz: a feed-forward of speed alone
_SEED = 1  # of the phases, with the motion's own


@dataclass(frozen=True)
class AxesMultisine:
    """A multisine on all axes: its name, seconds, band [Hz], and what draws its phases."""

    name: str
    seconds: float
    band: tuple[float, float]
    phases: int


def six_sines(setup: PlatformSetup, motion: AxesMultisine) -> np.ndarray:
    """Poses [k, 6] of size 1 m at the joints along each axis, as `sines` has them, at rest at home before and after."""
    rest = np.zeros((round(REST / setup.platform.period), LEGS))
    return np.vstack((rest, sines(setup.platform, motion, AXES), rest))


def sines(platform: Platform, motion: AxesMultisine, axes: Sequence[str]) -> np.ndarray:
    """Poses [k, 6] of size 1 m at the joints along each of the axes, from home and back: each has harmonics of its own,
    dealt in turn, so that whatever answers at a frequency answers one axis; sizes fall as 1/f, which is an even
    spectrum of speed."""
    period, low, high = platform.period, *motion.band
    t = np.arange(round(motion.seconds / period)) * period
    lines = np.arange(np.ceil(low * motion.seconds), np.floor(high * motion.seconds) + 1)
    turns = np.random.default_rng((_SEED, motion.phases)).uniform(0, 2 * np.pi, len(lines))
    waves = np.cos(2 * np.pi * np.outer(t / motion.seconds, lines) + turns) / lines
    fade = np.clip(np.minimum(t, motion.seconds - t) / _FADE, 0.0, 1.0)
    fade = fade**2 * (3 - 2 * fade)
    pose = np.zeros((len(t), LEGS))
    for place, axis in enumerate(axes):
        pose[:, AXES.index(axis)] = waves[:, place :: len(axes)].sum(axis=1) * fade
    return at_joints(platform, pose)


def at_joints(platform: Platform, pose: np.ndarray) -> np.ndarray:
    """Poses [k, 6] scaled to a largest displacement of 1 m at the joints along each axis that moves."""
    largest = np.abs(pose).max(axis=0) * platform.geometry.weights
    return pose / np.where(largest > 0, largest, 1.0)


def drive_spec(setup: PlatformSetup) -> PlatformSpec:
    """The platform's drive: a position loop on each leg, set to what its jack is declared to be, without effects, with
    the command of the reference's speed added."""
    forward = tuple(Forward(jack.v0, _INSTANT, 0.0) for jack in setup.platform.of_rigs(capability))
    own = {id(leg.rig): rig for leg, rig in zip(setup.platform.legs, setup.guarded, strict=True)}
    loops = {key: drive(replace(rig, effects=())).loop for key, rig in own.items()}
    return PlatformSpec("drive", tuple(loops[id(leg.rig)] for leg in setup.platform.legs), forward=forward)


def largest_run(
    setup: PlatformSetup, spec: PlatformSpec, shape: np.ndarray, seed: int, wished: float = _LARGEST
) -> tuple[float, PlatformRun] | None:
    """The largest size up to the one `wished` [m] at which limits and guards take poses [k, 6] of size 1 m at the
    joints, and the run along them; None where they do at none."""
    return _first(wished, lambda size: checked_run(setup, spec, size * shape, seed))


def largest_within_limits(setup: PlatformSetup, shape: np.ndarray, wished: float = _LARGEST) -> float | None:
    """The largest such size by limits alone."""
    taken = _first(wished, lambda size: check_motion(setup, size * shape))
    return None if taken is None else taken[0]


def _first(wished: float, made: Callable[[float], T]) -> tuple[float, T] | None:
    """The first of ever smaller sizes for which something can be made, and that; None where it can at none."""
    for size in (wished * _SMALLER ** np.arange(_TRIES)).tolist():
        try:
            return size, made(size)
        except InputError:
            continue
    return None


def checked_run(setup: PlatformSetup, spec: PlatformSpec, pose: np.ndarray, seed: int) -> PlatformRun:
    """A run along poses [k, 6]. Raises InputError where limits or guards do not take them."""
    check_motion(setup, pose)
    run = run_platform(setup, spec.build(setup.platform.period, setup.directions), pose, seed)
    if run.tripped is not None:
        raise InputError(f"record: {run.tripped} at {run.t[-1] - REST:.3f} s; play it smaller or slower")
    if run.signals["lowest_pressure"].min() < CAVITATES:
        raise InputError("record: gas comes out of the oil in a chamber; play it smaller or slower")
    return run


def still(setup: PlatformSetup, spec: PlatformSpec, seconds: float, seed: int) -> PlatformRun:
    """At rest at home."""
    pose = np.zeros((round(seconds / setup.platform.period) + 1, LEGS))
    return run_platform(setup, spec.build(setup.platform.period, setup.directions), pose, seed)
