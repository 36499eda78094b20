"""Plants drawn over what is uncertain of a rig: its numbers within bounds or factors, and a place in its stroke."""

from dataclasses import dataclass

import numpy as np

from ...loop.plant_lanes import drawn_evenly, uncertain
from ...plant import Plant
from .config import RobustnessConfig


@dataclass(frozen=True)
class PlantDraw:
    """Parameters p [plants, k], positions at the start [plants], m from mid stroke, and the drawn numbers [plants] by
    name, SI."""

    p: np.ndarray
    position: np.ndarray
    numbers: dict[str, np.ndarray]


def draw_plants(config: RobustnessConfig, plant: Plant) -> PlantDraw:
    """The plants of an experiment: the same for the same seed. The first is the nominal one at mid stroke."""
    random = np.random.default_rng(config.conditions.seed)
    numbers = {}
    for name, (low, high) in uncertain(config.rig, plant, config.factors).items():
        numbers[name] = drawn_evenly(random, low, high, config.plants)
        numbers[name][0] = config.rig[name]
    p = np.tile(plant.p, (config.plants, 1))
    for name, values in numbers.items():
        p[:, plant.parameters.index(name)] = values
    reach = config.stroke * config.rig.limit("stroke")
    way = config.step if config.signal.name == "position" else 0.0
    position = random.uniform(-reach, reach - way, config.plants)
    position[0] = 0.0
    if not config.rig.is_jack:
        position[:] = 0.0
    return PlantDraw(p, position, numbers)
