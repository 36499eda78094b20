"""The linear loops of every controller on the drawn plants: where each was drawn, and all at the same positions."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ...control.protocol import Controller
from ...linear.equilibria import Equilibria, moved
from ...loop.lane_laws import lane_laws, signals_at
from ...loop.lane_margins import LaneMargins, lane_margins, sampled_lanes
from ..common.numbers import finite, quantile
from .config import RobustnessConfig
from .drawn_plants import POINTS, DrawnPlants

_CHUNK = 200  # plants linearised at a time: every law is closed on them, and they are let go
_COLUMNS = [column.name for column in fields(LaneMargins)]


@dataclass(frozen=True)
class Place:
    """Where all plants are linearised: a `position` [m] from mid stroke, None where each was drawn; null or moving."""

    position: float | None
    point: str

    def __str__(self) -> str:
        where = "where drawn" if self.position is None else f"at {1e3 * self.position:+g} mm"
        return f"{where} {self.point}"


@dataclass(frozen=True)
class PlaceMargins:
    """A controller's loops on all plants at one place. A plant without an operating point there has an infinite
    radius."""

    place: Place
    margins: LaneMargins


def places(config: RobustnessConfig) -> list[Place]:
    """Where each plant was drawn, and at every position; a linear plant has none."""
    stroke = config.rig.limit("stroke")
    positions = [share * stroke for share in config.positions if config.rig.is_jack]
    return [Place(position, point) for position in (None, *positions) for point in POINTS]


def linear_loops(
    plants: DrawnPlants, controllers: Mapping[str, Controller], place: Place
) -> dict[str, dict[str, np.ndarray]]:
    """The loops at a place: the columns of LaneMargins by controller, of its linear view."""
    parts = list(_chunks(plants, controllers, place.position, plants.points[place.point]))
    return {
        name: {column: np.concatenate([getattr(part[name], column) for part in parts]) for column in _COLUMNS}
        for name in controllers
    }


def worst_places(places: list[PlaceMargins]) -> dict[str, np.ndarray]:
    """Plant by plant, over all places: `unstable`, and where the poles are furthest out; Ms and gain margin or NaN."""
    radius, ms, gain_margin = (
        np.stack([getattr(place.margins, name) for place in places]) for name in ("radius", "ms", "gain_margin_db")
    )
    unstable = np.any([~place.margins.stable for place in places], axis=0)
    return {
        "unstable": unstable,
        "furthest": np.argmax(radius, axis=0),
        "ms": np.where(unstable, np.nan, np.fmax.reduce(ms)),
        "gain_margin_db": np.where(unstable, np.nan, np.fmin.reduce(gain_margin)),
    }


def linear_rows(name: str, places: list[PlaceMargins]) -> list[dict[str, Any]]:
    """A row a place: how many loops are unstable, and the worst of the others' numbers; SI but for what keys say.

    The median of Ms counts an unstable loop as infinite, and is None where it is one; so is the largest Ms, or the
    least margin, where one loop is unstable.
    """
    return [_row(name, place) for place in places]


def _row(name: str, place: PlaceMargins) -> dict[str, Any]:
    margins, unstable = place.margins, ~place.margins.stable
    whole = not unstable.any()
    return {
        "controller": name,
        "plants": len(unstable),
        "position": place.place.position,
        "point": place.place.point,
        "unstable": int(unstable.sum()),
        "ms_p50": quantile(np.where(unstable, np.inf, margins.ms), 0.5),
        "ms_worst": finite(margins.ms.max()) if whole else None,
        "gain_margin_worst_db": finite(np.fmin.reduce(margins.gain_margin_db)) if whole else None,
        "phase_margin_worst_deg": finite(np.fmin.reduce(margins.phase_margin_deg)) if whole else None,
        "radius_worst": finite(margins.radius.max()),
    }


def _chunks(
    plants: DrawnPlants, controllers: Mapping[str, Controller], position: float | None, points: Equilibria
) -> Iterator[dict[str, LaneMargins]]:
    plant, period = plants.engine.plant, plants.rig.period.value
    measures = tuple(dict.fromkeys(name for law in controllers.values() for name in law.measures))
    for first in range(0, len(points.ok), _CHUNK):
        lanes = slice(first, first + _CHUNK)
        p = plant.without_dry_friction(plants.draw.p[lanes])
        about = Equilibria(points.x[lanes], points.u[lanes], points.ok[lanes])
        if position is not None:  # a specimen is relaxed there too
            about = moved(plant, p, about, position, specimen_position=position)
        sampled = sampled_lanes(plant, about, p, measures, period)
        at = signals_at(plants.engine, about, p)
        laws = {name: lane_laws(controller, at) for name, controller in controllers.items()}
        yield {name: lane_margins(sampled, law).where(about.ok, np.inf) for name, law in laws.items()}
