"""A robustness experiment on a platform: controllers, steps, and how far payload, pose and legs are drawn."""

import numpy as np

from ...base.units import Spec
from ...loop.platform.steps import AxisStep, PlatformDraw
from ...rigs.platform import AXES
from ..common.declared import ExperimentFile, count, declared, part
from ..common.envelope_keys import MOST_PLANTS, WITHIN, read_ends, read_factors
from ..common.platform_experiment import PlatformExperiment, read_steps

_SHIFT = Spec("m", 0.0, 10.0, "how far the centre of mass is drawn")
_WAY = (Spec("m", 0.0, 10.0, "how far poses are drawn"), Spec("rad", 0.0, 1.5, "how far poses are drawn"))


def _draw(at: ExperimentFile) -> PlatformDraw:
    payload, pose = at.top.table("payload", "mass", "centre"), at.top.table("pose", *AXES)
    way = np.array([pose.quantity(axis, _WAY[i // 3]) if axis in pose else 0.0 for i, axis in enumerate(AXES)])
    mass, centre = read_ends(payload, "mass"), payload.quantity("centre", _SHIFT)
    return PlatformDraw(mass, centre, way, read_factors(at.top, at.rig.legs[0].rig))


@declared
class PlatformRobustness(PlatformExperiment):
    """Steps by controllers on `plants` platforms, drawn by the seed of the `conditions`."""

    KIND = "robustness"
    plants: int = count(1, MOST_PLANTS, "platforms to draw", asked=True)
    steps: tuple[AxisStep, ...] = part(read_steps, {"scenarios": "steps along axes of the pose"})
    draw: PlatformDraw = part(_draw, {"payload": "how its mass is drawn", "pose": "either way from home", **WITHIN})
