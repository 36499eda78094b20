"""Plants drawn over what is uncertain of a rig: its numbers within bounds or factors, and a place in its stroke."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...loop.plant_lanes import drawn_evenly, uncertain
from ...plant import Plant
from ...plant.effects import numbers_of
from ...report import Table
from ...report.table import Cell
from ...rigs.rig import Rig


@dataclass(frozen=True)
class PlantDraw:
    """Parameters p [plants, k], positions at the start [plants], m from mid stroke, and the drawn numbers [plants] by
    name, SI."""

    p: np.ndarray
    position: np.ndarray
    numbers: dict[str, np.ndarray]

    def table(self, rig: Rig, *further: Sequence[Cell]) -> Table:
        """The least and the largest of each number, for a report; with `further` rows."""
        described = numbers_of(rig)
        rows = [
            [name, float(values.min()), float(values.max()), described[name].si]
            for name, values in self.numbers.items()
        ]
        rows.append(["position", float(self.position.min()), float(self.position.max()), "m"])
        return Table("Uniform within these ranges", ["number", "least", "largest", "unit"], [*rows, *further])

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
) -> PlantDraw:
    """So many plants of a rig, the same for the same seed; the first is the nominal one at mid stroke.

    `factors` [low, high] by name; every other number with bounds is drawn within them, the position within `span` [m].
    A rig without a stroke has none.
    """
    random = np.random.default_rng(seed)
    numbers = {}
    for name, (low, high) in uncertain(rig, plant, factors).items():
        numbers[name] = drawn_evenly(random, low, high, plants)
        numbers[name][0] = plant.p[plant.parameters.index(name)]
    p = np.tile(plant.p, (plants, 1))
    for name, values in numbers.items():
        p[:, plant.parameters.index(name)] = values
    position = random.uniform(*span, plants)
    position[0] = 0.0
    if not rig.is_jack:
        position[:] = 0.0
    return PlantDraw(p, position, numbers)
