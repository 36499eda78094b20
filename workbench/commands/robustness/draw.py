"""Plants drawn over what is uncertain of a rig: its numbers within bounds or factors, and a place in its stroke."""

from dataclasses import dataclass

import numpy as np

from ...plant import Plant
from .config import RobustnessConfig


@dataclass(frozen=True)
class PlantDraw:
    """Parameters p [plants, k], positions at the start [plants] m, and the drawn numbers [plants] by name, SI."""

    p: np.ndarray
    position: np.ndarray
    numbers: dict[str, np.ndarray]


def draw_plants(config: RobustnessConfig, plant: Plant) -> PlantDraw:
    """The plants of an experiment: the same for the same seed. The first is the nominal one at mid stroke."""
    random = np.random.default_rng(config.seed)
    numbers = {}
    for name, number in config.rig.numbers.items():
        low, high = config.factors.get(name, (None, None))
        if low is not None and high is not None:
            low, high = low * number.value, high * number.value
        elif number.low is not None and number.high is not None:
            low, high = number.low, number.high
        if low is None or high is None or name not in plant.parameters:
            continue
        drawn = random.uniform(low, high, config.plants)
        drawn[0] = number.value
        numbers[name] = drawn
    p = np.tile(plant.p, (config.plants, 1))
    for name, drawn in numbers.items():
        p[:, plant.parameters.index(name)] = drawn
    reach = config.stroke * config.rig.limit("stroke")
    position = config.rig["xmid"] + random.uniform(-reach, reach - config.step, config.plants)
    position[0] = config.rig["xmid"]
    return PlantDraw(p, position, numbers)
