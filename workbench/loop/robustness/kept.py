"""What is kept of every block of plants: of a controller plant by plant, and of its loops at every place."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...base.kept_columns import KeptColumns
from ...control.controller_spec import ControllerSpec
from ..margins import LaneMargins
from .linear_loops import Place, linear_row, of_place, places, worst_places
from .problem import RobustnessProblem
from .workers import linear_stage, steps_stage

_STEPS = "settling_s", "overshoot_percent", "hunting", "tripped", "lowest_pressure", "held_ms", "held_unstable"
_WORST = "unstable", "ms", "gain_margin_db"


@dataclass(frozen=True)
class Kept:
    """Of a controller: `lanes`, columns [plants] of its steps and of its worst linear loop, empty without steps; of
    each `place` a name in front of the columns of `of_place`; at which of them a plant is `furthest` from stable."""

    spec: ControllerSpec
    delay: float
    at: list[Place]
    lanes: KeptColumns = field(default_factory=KeptColumns)
    loops: KeptColumns = field(default_factory=KeptColumns)

    @classmethod
    def of(cls, spec: ControllerSpec, problem: RobustnessProblem) -> "Kept":
        """Of a controller with its own computing delay, or the rig's."""
        return cls(spec, problem.conditions.delay(spec, problem.rig), places(problem))

    def take(self, results: Mapping[str, dict[str, Any]], block: range) -> None:
        """Put a block of plants behind those before, of the results of its stages."""
        margins = [LaneMargins(**results[linear_stage(place, self.delay, block)][self.spec.name]) for place in self.at]
        for place, loops in zip(self.at, margins, strict=True):
            self.loops.append({f"{place} {name}": values for name, values in of_place(loops).items()})
        steps = results.get(steps_stage(self.spec, self.delay, block))
        if steps is not None:
            worst = worst_places(margins)
            self.lanes.append({key: steps[key] for key in _STEPS} | {key: worst[key] for key in _WORST})
            self.loops.append({"furthest": worst["furthest"], "cpu_seconds": steps["cpu_seconds"]})

    def linear_rows(self) -> list[dict[str, Any]]:
        """A row a place."""
        names = "ms", "unstable", "gain_margin_db", "phase_margin_deg", "radius"
        return [
            linear_row(self.spec.name, place, {name: self.loops[f"{place} {name}"] for name in names})
            for place in self.at
        ]

    def furthest(self, lane: int) -> Place:
        """Where the poles of a plant are furthest out."""
        return self.at[self.loops["furthest"][lane]]

    @property
    def cpu_seconds(self) -> float:
        """What the steps took."""
        return float(np.sum(self.loops["cpu_seconds"]))
