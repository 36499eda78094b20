"""The rigs of the set as lanes of one plant, with the numbers of the rig that were moved."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.errors import InputError
from ...engine import Engine
from ...linear.equilibria import Equilibria, moved
from ...linear.operating_point import far_end
from ...loop.plant_lanes import PlantLanes, plant_lanes
from ...loop.rig_variations import with_delay
from ...plant import build
from ...rigs.rig import Rig


@dataclass(frozen=True)
class RigPoint:
    """Numbers of the nominal rig that were moved, SI, by name, and the operating position [m] from mid stroke."""

    values: Mapping[str, float] = field(default_factory=dict)
    position: float = 0.0


def set_lanes(rigs: Mapping[str, Rig], delay: float) -> PlantLanes:
    """Rigs by name, the nominal one first, at mid stroke, their commands `delay` [s] later.

    Raises InputError for rigs whose plants differ in more than numbers, and where there is no operating point.
    """
    plants = {name: build(with_delay(rig, delay)) for name, rig in rigs.items()}
    first, nominal = next(iter(plants.items()))
    for name, plant in plants.items():
        if plant.parameters != nominal.parameters:
            raise InputError(f"rig {name} differs from {first} in more than numbers; leave it out of the set")
    p = np.array([plant.p for plant in plants.values()])
    late = with_delay(rigs[first], delay)
    return plant_lanes(late, Engine(nominal), list(rigs), p, np.zeros(len(p)))


def moved_lanes(lanes: PlantLanes, point: RigPoint) -> PlantLanes:
    """Lanes with other numbers of the nominal rig, which all rigs of the set follow in proportion, elsewhere.

    Operating points start from those of `lanes`. Raises InputError for numbers that the rig cannot have.
    """
    rig, plant = lanes.rig, lanes.engine.plant
    after, p = rig.with_values(**point.values), lanes.p.copy()
    for name, value in point.values.items():
        p[:, plant.parameters.index(name)] *= value / rig[name]
    position = np.full(len(p), point.position)
    smooth = plant.without_dry_friction(p)
    null, moving = (_moved(lanes, of, at, position) for of, at in ((p, lanes.null), (smooth, lanes.moving)))
    return replace(lanes, rig=after, p=p, position=position, null=null, moving=moving)


def _moved(lanes: PlantLanes, p: np.ndarray, start: Equilibria, position: np.ndarray) -> Equilibria:
    """For a plant without a stroke, only the numbers."""
    plant = lanes.engine.plant
    if not lanes.rig.is_jack:
        return start
    return moved(plant, p, start, position, **far_end(plant, position, start.x[:, plant.state("v")]))
