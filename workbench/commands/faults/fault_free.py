"""Loops without a fault on drawn plants: every trip of the guard is a false one."""

from collections import Counter
from collections.abc import Mapping

import numpy as np

from ...control.protocol import Controller
from ...engine.guard_shape import TRIPS
from ...linear.equilibria import equilibria
from ...linear.operating_point import far_end
from ...loop.lane_loop import play_lanes
from ..common.plant_draw import draw_plants
from .config import FaultsConfig
from .played import Stand


def false_trips(config: FaultsConfig, stand: Stand, controller: Controller) -> Mapping[str, int]:
    """How many of the plants tripped the guard in the step, by what tripped it; "simulation" where it failed."""
    loops, plant = stand.loops, stand.engine.plant
    reach = config.stroke * stand.rig.limit("stroke")
    span = (-reach, reach - loops.step) if loops.signal == "position" else (-reach, reach)
    draw = draw_plants(stand.rig, plant, loops.factors, config.plants, config.conditions.seed, span)
    points = equilibria(plant, draw.p, draw.position, None, None, **far_end(plant, draw.position))
    reference = np.full(round(config.seconds / stand.rig.period.value), loops.step)
    trips: Counter[str] = Counter()
    played = play_lanes(
        stand.engine, stand.rig, controller, points, draw.p, reference, (loops.signal,), config.conditions.noise
    )
    for _, lanes in played:
        trips.update(
            "simulation" if failed else TRIPS[int(trip)] for trip, failed in zip(lanes.trip, lanes.failed, strict=True)
        )
    return {name: count for name, count in sorted(trips.items()) if name}
