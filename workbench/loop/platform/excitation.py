"""Motions that tell the six axes of a platform apart, as large as its legs take them, and what plays them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...control.platform_controller import LEGS, Forward, PlatformSpec
from ..capability import capability
from .loop import PlatformRun, run_platform
from .poses import REST
from .record import check_motion
from .setup import PlatformSetup

_FADE = 0.25  # s: over which a motion comes and goes
_LARGEST, _SMALLER, _TRIES = 0.1, 0.7, 20  # m at the joints; times; sizes that are tried
_INSTANT = 1e4  # Hz: a feed-forward of speed alone
_SEED = 1  # of the phases, with the motion's own


@dataclass(frozen=True)
class Motion:
    """A multisine on all axes: its name, seconds, band [Hz], and what draws its phases."""

    name: str
    seconds: float
    band: tuple[float, float]
    phases: int


def six_sines(setup: PlatformSetup, motion: Motion) -> np.ndarray:
    """Poses [k, 6] of size 1 m at the joints: each axis has harmonics of its own, dealt in turn, so that whatever
    answers at a frequency answers one axis; sizes fall as 1/f, which is an even spectrum of speed. At rest at home
    before and after."""
    period, low, high = setup.platform.period, *motion.band
    t = np.arange(round(motion.seconds / period)) * period
    lines = np.arange(np.ceil(low * motion.seconds), np.floor(high * motion.seconds) + 1)
    turns = np.random.default_rng((_SEED, motion.phases)).uniform(0, 2 * np.pi, len(lines))
    waves = np.cos(2 * np.pi * np.outer(t / motion.seconds, lines) + turns) / lines
    pose = np.column_stack([waves[:, axis::LEGS].sum(axis=1) for axis in range(LEGS)])
    fade = np.clip(np.minimum(t, motion.seconds - t) / _FADE, 0.0, 1.0)
    pose *= (fade**2 * (3 - 2 * fade))[:, None]
    rest = np.zeros((round(REST / period), LEGS))
    whole = np.vstack((rest, pose, rest))
    return whole / (np.abs(whole).max(axis=0) * setup.platform.geometry.weights)


def drive_spec(setup: PlatformSetup, laws: Sequence[ControllerSpec]) -> PlatformSpec:
    """A position loop on each leg, with the command of the reference's speed added."""
    forward = tuple(Forward(jack.v0, _INSTANT, 0.0) for jack in setup.platform.of_rigs(capability))
    return PlatformSpec("drive", tuple(laws), forward=forward)


def largest_run(setup: PlatformSetup, spec: PlatformSpec, shape: np.ndarray, name: str, seed: int) -> PlatformRun:
    """A run along the poses [k, 6] at the largest size that limits and guards take. Raises InputError for none."""
    for size in _LARGEST * _SMALLER ** np.arange(_TRIES):
        try:
            check_motion(setup, size * shape)
        except InputError:
            continue
        run = run_platform(setup, spec.build(setup.platform.period, setup.directions), size * shape, seed)
        if run.tripped is None and run.signals["lowest_pressure"].min() > 0:
            return run
    raise InputError(f"platform {setup.platform.name}: cannot play {name} at any size; check its limits")


def still(setup: PlatformSetup, spec: PlatformSpec, seconds: float, seed: int) -> PlatformRun:
    """At rest at home."""
    pose = np.zeros((round(seconds / setup.platform.period) + 1, LEGS))
    return run_platform(setup, spec.build(setup.platform.period, setup.directions), pose, seed)
