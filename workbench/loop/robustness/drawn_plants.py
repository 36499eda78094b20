"""Plants drawn over what is uncertain of a rig, its numbers within bounds or factors and a place in its stroke, and
what every controller's loops need of them: the engine, and operating points at null and moving.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np

from ...engine import Engine
from ...plant import Plant, build
from ...plant.effects import numbers_of
from ...rigs.rig import Rig
from ..plant_lanes import PlantLanes, drawn_evenly, plant_lanes, uncertain
from ..rig_variations import with_delay
from .problem import RobustnessProblem

POINTS = ("null", "moving")


@dataclass(frozen=True)
class PlantDraw:
    """Drawn numbers [plants] by name, SI, of a `plant` that has all others, and positions at the start [plants], m from
    mid stroke."""

    of: Plant
    position: np.ndarray
    numbers: dict[str, np.ndarray]

    @cached_property
    def p(self) -> np.ndarray:
        """Parameters [plants, k]."""
        p = np.tile(self.of.p, (len(self.position), 1))
        for name, values in self.numbers.items():
            p[:, self.of.parameters.index(name)] = values
        return p

    def plant(self, lane: int, rig: Rig) -> dict[str, float]:
        """Position and numbers of one of them, by name with unit."""
        numbers = {name: float(values[lane]) for name, values in _with_units(self.numbers, rig).items()}
        return {"x [m]": float(self.position[lane])} | numbers

    def columns(self, rig: Rig) -> dict[str, np.ndarray]:
        """Position and numbers [plants] by name with unit."""
        return {"position [m]": self.position} | _with_units(self.numbers, rig)


def _with_units(numbers: Mapping[str, np.ndarray], rig: Rig) -> dict[str, np.ndarray]:
    described = numbers_of(rig)
    return {f"{name} [{described[name].si}]": values for name, values in numbers.items()}


def draw_plants(
    rig: Rig,
    plant: Plant,
    factors: Mapping[str, tuple[float, float]],
    plants: int,
    seed: int,
    span: tuple[float, float],
    block: range | None = None,
) -> PlantDraw:
    """So many plants of a rig, the same for the same seed; the first is the nominal one at mid stroke.

    `factors` [low, high] by name; every other number with bounds is drawn within them, the position within `span` [m].
    A rig without a stroke has none. A `block` of them is drawn without the others, and is what it is among all.
    """
    block = range(plants) if block is None else block
    ranges = uncertain(rig, plant, factors)
    numbers = {
        name: drawn_evenly(_random(seed, i * plants + block.start), *ends, len(block))
        for i, (name, ends) in enumerate(ranges.items())
    }
    position = _random(seed, len(ranges) * plants + block.start).uniform(*span, len(block))
    if 0 in block:
        position[0] = 0.0
        for name, values in numbers.items():
            values[0] = plant.p[plant.parameters.index(name)]
    if not rig.is_jack:
        position[:] = 0.0
    return PlantDraw(plant, position, numbers)


def _random(seed: int, first: int) -> np.random.Generator:
    """The generator of a seed, past its `first` draws."""
    counted = np.random.PCG64(seed)
    counted.advance(first)
    return np.random.Generator(counted)


def drawn(problem: RobustnessProblem, plant: Plant, block: range | None = None) -> PlantDraw:
    """All drawn plants, or a `block` of them, equal for equal seeds. The first is the nominal one at mid stroke."""
    reach = problem.stroke * problem.rig.limit("stroke")
    way = problem.step if problem.signal.name == "position" else 0.0
    span = -reach, reach - way
    return draw_plants(problem.rig, plant, problem.factors, problem.plants, problem.conditions.seed, span, block)


@dataclass(frozen=True)
class DrawnPlants(PlantLanes):
    """A `block` of the drawn plants of a rig with its computing delay, as they were drawn."""

    block: range
    draw: PlantDraw


def plants_by_block(problem: RobustnessProblem) -> Callable[[float, range], DrawnPlants]:
    """The drawn plants by computing delay [s] and block; the last ones are kept, for several tasks need them."""
    stand = cache(lambda delay: Engine(build(with_delay(problem.rig, delay))))
    return lru_cache(1)(lambda delay, block: drawn_plants(problem, with_delay(problem.rig, delay), stand(delay), block))


def drawn_plants(problem: RobustnessProblem, rig: Rig, engine: Engine, block: range) -> DrawnPlants:
    """Draw and balance a block of them. Raises InputError where the nominal one has no such point."""
    draw = drawn(problem, engine.plant, block)
    lanes = plant_lanes(rig, engine, [f"drawn {i}" for i in block], draw.p, draw.position)
    return DrawnPlants(**vars(lanes), block=block, draw=draw)
