"""The file of a platform's robustness experiment: controllers, steps, and how far payload, pose and legs are drawn."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.table import Table
from ...base.units import Spec
from ...control.platform_controller import PlatformSpec
from ...loop.conditions import Conditions
from ...loop.platform.draw import Ends, PlatformDraw
from ...loop.platform.steps import AxisStep
from ...rigs.platform import AXES, Platform, load_platform
from ..common.envelope_keys import MOST_PLANTS, read_factors
from ..common.experiment import borrowed_controllers, read_conditions
from ..common.platform_controllers import platform_controller

KEYS = ("experiment", "rig", "plants", "seed", "ideal", "scenarios", "payload", "pose", "draw", "from")
_SHIFT = Spec("m", 0.0, 10.0, "how far the centre of mass is drawn")
_WAY = (Spec("m", 0.0, 10.0, "how far poses are drawn"), Spec("rad", 0.0, 1.5, "how far poses are drawn"))


@dataclass(frozen=True)
class PlatformRobustness:
    """Steps by controllers on `plants` platforms, drawn by the seed of the `conditions`. `source` is the file, with the
    tables of its controllers."""

    rig: Platform
    plants: int
    conditions: Conditions
    steps: tuple[AxisStep, ...]
    draw: PlatformDraw
    controllers: tuple[PlatformSpec, ...]
    source: Mapping[str, Any]

    @property
    def delay(self) -> float:
        """Computing delay [s]."""
        return 0.0 if self.conditions.ideal else self.rig.legs[0].rig.computing_delay.value


def platform_robustness(top: Table, path: Path, rig: str | None, plants: int | None) -> PlatformRobustness:
    """The tables of the file; `rig` and `plants` replace what it says. Raises InputError with file, line and key."""
    top.word("experiment", ["robustness"])
    top.allow(*KEYS)
    platform = load_platform(rig) if rig else load_platform(top.text("rig"), path.parent)
    tables = borrowed_controllers(top.table("from"), path.parent)
    payload, pose = top.table("payload", "mass", "centre"), top.table("pose", *AXES)
    way = [pose.quantity(axis, _WAY[i // 3]) if axis in pose else 0.0 for i, axis in enumerate(AXES)]
    names = top.words("scenarios", "heave-10mm")
    return PlatformRobustness(
        platform,
        plants or top.count("plants", 1, MOST_PLANTS),
        read_conditions(top),
        tuple(top.about("scenarios", lambda name=name: AxisStep.named(name)) for name in names),
        PlatformDraw(
            _mass(payload), payload.quantity("centre", _SHIFT), np.array(way), read_factors(top, platform.legs[0].rig)
        ),
        tuple(platform_controller(name, part, platform) for name, part in tables.items()),
        {**top.values, "controllers": {name: part.values for name, part in tables.items()}},
    )


def _mass(table: Table) -> Ends:
    low, *high = table.numbers("mass", "[0.75, 1.25]")
    if len(high) != 1 or not 0 < low <= high[0]:
        raise table.complaint("mass", "write the least and the largest factor, such as [0.75, 1.25]")
    return low, high[0]
