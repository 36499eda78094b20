"""Motions that no platform has played yet: played in simulation on the platform as fitted, its legs cut out as those of
a campaign are."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import PlatformSpec
from ...loop.platform import PlatformRun, PlatformSetup
from ...loop.platform.excitation import checked_run, largest_run, largest_within_limits
from ...loop.platform.poses import recorded_pose
from ...records import Record
from ...rigs.platform import LEGS, Platform
from ..fit.free_parameters import Candidate
from ..wrench.leg_cut import CELL, NEEDED, cut_records
from .motions import MotionDesign, PlannedMotion
from .played import with_effect

_SEED = 0  # of the noise that its sensors stir the drive with


def planned_motion(
    setup: PlatformSetup, spec: PlatformSpec, declared: PlatformSetup, design: MotionDesign
) -> tuple[PlannedMotion, PlatformRun] | None:
    """The motion as large as the platform as fitted takes it, within the limits of the one that is `declared` too, and
    played as its file would be; None where it is taken at no size."""
    shape = as_played(setup.platform, PlannedMotion.sized(design, setup.platform, 1.0))
    allowed = largest_within_limits(declared, shape, design.wished)
    taken = None if allowed is None else largest_run(setup, spec, shape, _SEED, allowed)
    if taken is None:
        return None
    size, run = taken
    return PlannedMotion.sized(design, setup.platform, size), run


def played_again(setup: PlatformSetup, spec: PlatformSpec, motion: PlannedMotion) -> PlatformRun | None:
    """The run of a planned motion on another platform; None where its limits or guards do not take it."""
    try:
        return checked_run(setup, spec, as_played(setup.platform, motion), _SEED)
    except InputError:
        return None


def as_played(platform: Platform, motion: PlannedMotion) -> np.ndarray:
    """The poses [n, 6] that a file of the motion is played as."""
    return recorded_pose(platform, motion.t, motion.course)


def cut_run(platform: Platform, run: PlatformRun, name: str, signals: Collection[str]) -> list[Record]:
    """The legs of a run as records of jacks, without noise: `signals` are those that the campaign has of a leg."""
    kept = dict.fromkeys((*signals, CELL, *NEEDED))
    legs = [
        {"command": run.sent[:, leg], **{each: run.signals[f"leg{leg + 1}.{each}"] for each in kept}}
        for leg in range(LEGS)
    ]
    return cut_records(platform, [Record(name, run.t, own) for own in legs])


def with_effect_in(platform: Platform, leg: int, candidate: Candidate) -> Platform:
    """The platform with an effect in a leg, counted from 0, at the strength that it is compared at; commands that are
    late are so in all legs, which one computer commands."""
    late = candidate.effect.delay
    legs = [
        replace(own, rig=with_effect(own.rig, candidate)) if late or place == leg else own
        for place, own in enumerate(platform.legs)
    ]
    return replace(platform, legs=tuple(legs))
