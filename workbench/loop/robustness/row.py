"""What is kept of every block of plants, of a controller plant by plant and of its loops at every place; and one row of
a controller over all of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...base.kept_columns import KeptColumns
from ...base.numbers import finite, quantile
from ...control.controller_spec import ControllerSpec
from ...plant import build
from ...rigs.oil import CAVITATES
from ..limit import times_limit
from ..margins import LaneMargins
from .drawn_plants import drawn
from .linear_loops import Place, linear_row, of_place, places, worst_places
from .problem import RobustnessProblem
from .workers import linear_stage, steps_stage

_STEPS = "settling_s", "overshoot_percent", "hunting", "tripped", "lowest_pressure", "held_ms", "held_unstable"
_WORST = "unstable", "ms", "gain_margin_db"
_WEIGHTS = {"unstable": 4, "tripped": 2, "hunting": 1}  # how bad, for the worst plant


@dataclass(frozen=True)
class Kept:
    """A controller's columns [plants]. `lanes`: its steps and its worst linear loop, empty without steps. `loops`: what
    `of_place` has at each place, behind the place's name, and `furthest`, the index of the place at which a plant is
    furthest from stable."""

    spec: ControllerSpec
    delay: float
    at: list[Place]
    lanes: KeptColumns = field(default_factory=KeptColumns)
    loops: KeptColumns = field(default_factory=KeptColumns)

    @classmethod
    def of(cls, spec: ControllerSpec, problem: RobustnessProblem) -> "Kept":
        """The empty columns of a controller with its own computing delay, or the rig's."""
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
        """The place at which the poles of a plant are furthest out."""
        return self.at[self.loops["furthest"][lane]]

    @property
    def cpu_seconds(self) -> float:
        """What the steps took."""
        return float(np.sum(self.loops["cpu_seconds"]))


def kept_row(kept: Kept, problem: RobustnessProblem, limit: float | None) -> dict[str, Any]:
    """One row: quantiles count a plant that never settles as the slowest; None where that is one.

    `failing`: on how many plants anything is wrong. `times_limit`: the time in which 99 % settle, over the `limit` [s]
    of the nominal rig at mid stroke.
    """
    columns = kept.lanes  # each is read where it is needed: all at once would be 43 bytes a plant
    settling = columns["settling_s"]
    settling[np.isnan(settling) | columns["tripped"]] = np.inf
    quantiles = settling_quantiles(settling)
    bad = np.sum([weight * columns[key].view(np.uint8) for key, weight in _WEIGHTS.items()], axis=0, dtype=np.uint8)
    lane = int(np.lexsort((np.nan_to_num(columns["ms"], nan=np.inf), settling, bad))[-1])
    unstable = bool(columns["unstable"].any())
    return {
        "controller": kept.spec.name,
        "plants": len(settling),
        **{key: int(columns[key].sum()) for key in ("unstable", "tripped", "hunting")},
        **quantiles,
        "overshoot_worst_percent": finite(np.max(columns["overshoot_percent"])),
        "ms_worst": None if unstable else finite(np.max(columns["ms"])),
        "gain_margin_worst_db": None if unstable else finite(np.fmin.reduce(columns["gain_margin_db"])),
        "failing": int(((bad > 0) | columns["held_unstable"].astype(bool)).sum()),
        "cavitating": int((columns["lowest_pressure"] < CAVITATES).sum()),
        "times_limit": times_limit(quantiles["settling_p99_s"], limit),
        "held_unstable": int(columns["held_unstable"].sum()),
        "held_ms_worst": finite(np.fmax.reduce(columns["held_ms"])),
        "worst": _drawn(lane, problem, kept.furthest(lane) if columns["unstable"][lane] else None),
    }


def settling_quantiles(settling: np.ndarray) -> dict[str, float | None]:
    """The median, 99 % and the worst of settling times [plants] s, infinite on a plant that never settles."""
    shares = {"p50": 0.5, "p99": 0.99, "worst": 1.0}
    return {f"settling_{name}_s": quantile(settling, share) for name, share in shares.items()}


def _drawn(lane: int, problem: RobustnessProblem, place: Place | None) -> dict[str, float]:
    """The numbers of a plant, and its position: at `place`, else where it was drawn."""
    numbers = drawn(problem, build(problem.rig), range(lane, lane + 1)).plant(0, problem.rig)
    if place is not None and place.position is not None:
        numbers["x [m]"] = place.position
    return numbers
