"""The linear loops of every controller on the drawn plants: where each was drawn, and all at the same positions."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ...base.numbers import finite, quantile
from ...control.protocol import Controller
from ...linear.equilibria import Equilibria, moved
from ..lane_laws import lane_laws
from ..margins import LaneMargins, LoopLanes
from ..sampled_lanes import sampled_lanes
from .drawn_plants import POINTS, DrawnPlants
from .problem import RobustnessProblem

_CHUNK = 200  # plants linearised at a time: every law is closed on them, and they are let go
_COLUMNS = [column.name for column in fields(LaneMargins)]


@dataclass(frozen=True)
class Place:
    """A place at which all plants are linearised: a `position` [m] from mid stroke, or None for that at which each was
    drawn; at null or moving."""

    position: float | None
    point: str

    def __str__(self) -> str:
        where = "where drawn" if self.position is None else f"at {1e3 * self.position:+g} mm"
        return f"{where} {self.point}"


def places(problem: RobustnessProblem) -> list[Place]:
    """The places of a problem: where each plant was drawn and, for a jack, each named position; at null and moving."""
    stroke = problem.rig.limit("stroke")
    positions = [share * stroke for share in problem.positions if problem.rig.is_jack]
    return [Place(position, point) for position in (None, *positions) for point in POINTS]


def linear_loops(
    plants: DrawnPlants,
    controllers: Mapping[str, Controller | Sequence[Controller]],
    place: Place,
    remembered: np.ndarray | None = None,
) -> dict[str, dict[str, np.ndarray]]:
    """The loops at a place: the columns of LaneMargins by controller, or by one's designs for each plant, of the linear
    view; `remembered` [plants, m] is what a single one has in its memory on each.

    A plant without an operating point there has an infinite radius.
    """
    parts = list(_chunks(plants, controllers, place.position, getattr(plants, place.point), remembered))
    return {
        name: {column: np.concatenate([getattr(part[name], column) for part in parts]) for column in _COLUMNS}
        for name in controllers
    }


def worst_places(places: list[LaneMargins]) -> dict[str, np.ndarray]:
    """Plant by plant, over all places: `unstable`, and where the poles are furthest out; Ms and gain margin or NaN."""
    radius, ms, gain_margin = (
        np.stack([getattr(place, name) for place in places]) for name in ("radius", "ms", "gain_margin_db")
    )
    unstable = np.any([~place.stable for place in places], axis=0)
    return {
        "unstable": unstable,
        "furthest": np.argmax(radius, axis=0),
        "ms": np.where(unstable, np.nan, np.fmax.reduce(ms)),
        "gain_margin_db": np.where(unstable, np.nan, np.fmin.reduce(gain_margin)),
    }


def of_place(margins: LaneMargins) -> dict[str, np.ndarray]:
    """What a row needs of a block of plants: Ms of each [plants], infinite of an unstable loop; [1] each, how many are
    unstable and the worst of the rest."""
    worst = {
        "unstable": (~margins.stable).sum(),
        "gain_margin_db": np.fmin.reduce(margins.gain_margin_db),
        "phase_margin_deg": np.fmin.reduce(margins.phase_margin_deg),
        "radius": margins.radius.max(),
    }
    return {"ms": np.where(margins.stable, margins.ms, np.inf)} | {key: np.array([x]) for key, x in worst.items()}


def linear_row(name: str, place: Place, columns: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """How many loops of a controller at a place are unstable, and the worst of the others' numbers, of the columns that
    `of_place` makes of its blocks; SI but for what keys say.

    The median of Ms counts an unstable loop as infinite, and is None where it is one; so is the largest Ms, or the
    least margin, where one loop is unstable.
    """
    ms, unstable = columns["ms"], int(columns["unstable"].sum())
    return {
        "controller": name,
        "plants": len(ms),
        "position": place.position,
        "point": place.point,
        "unstable": unstable,
        "ms_p50": quantile(ms, 0.5),
        "ms_worst": None if unstable else finite(ms.max()),
        "gain_margin_worst_db": None if unstable else finite(np.fmin.reduce(columns["gain_margin_db"])),
        "phase_margin_worst_deg": None if unstable else finite(np.fmin.reduce(columns["phase_margin_deg"])),
        "radius_worst": finite(columns["radius"].max()),
    }


def _chunks(
    plants: DrawnPlants,
    controllers: Mapping[str, Controller | Sequence[Controller]],
    position: float | None,
    points: Equilibria,
    remembered: np.ndarray | None,
) -> Iterator[dict[str, LaneMargins]]:
    plant, period = plants.engine.plant, plants.rig.period.value
    one_each = [law[0] if isinstance(law, Sequence) else law for law in controllers.values()]
    measures = tuple(dict.fromkeys(name for law in one_each for name in law.measures))
    for first in range(0, len(points.ok), _CHUNK):
        lanes = slice(first, first + _CHUNK)
        p = plant.without_dry_friction(plants.draw.p[lanes])
        about = Equilibria(points.x[lanes], points.u[lanes], points.ok[lanes])
        if position is not None:  # a specimen is relaxed there too
            about = moved(plant, p, about, position, specimen_position=position)
        sampled = sampled_lanes(plant, about, p, measures, period)
        own = {name: law[lanes] if isinstance(law, Sequence) else law for name, law in controllers.items()}
        kept = None if remembered is None else remembered[lanes]
        laws = {name: lane_laws(law, sampled.signals, kept) for name, law in own.items()}
        yield {name: LoopLanes(sampled, law).margins().where(about.ok, np.inf) for name, law in laws.items()}
