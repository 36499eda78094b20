"""The file of a platform's robustness experiment: controllers, steps, and how far payload, pose and legs are drawn."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.table import ConfigTable
from ...base.units import Spec
from ...loop.platform.steps import AxisStep, PlatformDraw
from ...rigs.platform import AXES
from ..common.envelope_keys import MOST_PLANTS, read_ends, read_factors
from ..common.platform_experiment import PlatformExperiment, platform_experiment, read_steps

KEYS = ("experiment", "rig", "plants", "seed", "ideal", "scenarios", "payload", "pose", "draw", "from")
_SHIFT = Spec("m", 0.0, 10.0, "how far the centre of mass is drawn")
_WAY = (Spec("m", 0.0, 10.0, "how far poses are drawn"), Spec("rad", 0.0, 1.5, "how far poses are drawn"))


@dataclass(frozen=True, kw_only=True)
class PlatformRobustness(PlatformExperiment):
    """Steps by controllers on `plants` platforms, drawn by the seed of the `conditions`."""

    plants: int
    steps: tuple[AxisStep, ...]
    draw: PlatformDraw


def platform_robustness(top: ConfigTable, path: Path, rig: str | None, plants: int | None) -> PlatformRobustness:
    """The tables of the file; `rig` and `plants` replace what it says. Raises InputError with file, line and key."""
    top.word("experiment", ["robustness"])
    top.allow(*KEYS)
    shared = platform_experiment(top, path, rig, borrows=True)
    payload, pose = top.table("payload", "mass", "centre"), top.table("pose", *AXES)
    way = np.array([pose.quantity(axis, _WAY[i // 3]) if axis in pose else 0.0 for i, axis in enumerate(AXES)])
    mass, centre = read_ends(payload, "mass"), payload.quantity("centre", _SHIFT)
    return PlatformRobustness(
        **vars(shared),
        plants=plants or top.count("plants", 1, MOST_PLANTS),
        steps=read_steps(top),
        draw=PlatformDraw(mass, centre, way, read_factors(top, shared.rig.legs[0].rig)),
    )
