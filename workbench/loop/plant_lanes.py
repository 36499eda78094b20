"""Plants in lanes with their operating points: what loops of all designs on many plants share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..control.protocol import Controller
from ..engine import Engine
from ..linear.equilibria import Equilibria, equilibria
from ..linear.operating_point import far_end, moving_point
from ..plant import Plant
from ..plant.effects import numbers_of
from ..rigs.rig import Rig
from .lane_laws import lane_laws, lane_views
from .margins import LaneMargins, LoopLanes, closed_response
from .sampled_lanes import SampledLanes, sampled_lanes

_NONE = 2.0  # radius [1] of a loop on a plant without an operating point: finite, so that searches can compare
_NEAR, _MOST = 0.12, 16  # rad or neper between points of a curve that is drawn; points between two of its loop
_WIDE = 5.0  # high over low: from there on a range is one of orders of magnitude


@dataclass(frozen=True)
class LinearLanes:
    """Margins [lanes] at null and moving; at null each lane's frequencies [k] in Hz and its loop there, broken at the
    command, and over those of the first lane reference -> controlled signal [k], which of an unstable loop none can
    see."""

    null: LaneMargins
    moving: LaneMargins
    curves: list[tuple[np.ndarray, np.ndarray]]
    closed: np.ndarray


@dataclass(frozen=True)
class PlantLanes:
    """Plants of one structure: their `names` [lanes], parameters p [lanes, k] and `position` [lanes], m
    from mid stroke.

    `null` and `moving`: where they stand there, and where they pass at 0.1 m/s. The rig gives limits, sensors and the
    period to all of them. Linear loops are without dry friction.
    """

    rig: Rig
    engine: Engine
    names: tuple[str, ...]
    p: np.ndarray
    position: np.ndarray
    null: Equilibria
    moving: Equilibria

    def margins(self, controller: Controller, remembered: np.ndarray | None = None) -> tuple[LaneMargins, LaneMargins]:
        """The linear loops of a controller at null and moving; a plant without such a point counts as unstable.

        `remembered` [lanes, m]: what it has in its memory. Raises InputError where the controller has no linear view.
        """
        null, moving = (
            LoopLanes(sampled, lane_laws(controller, sampled.signals, remembered)).margins().where(points.ok, _NONE)
            for sampled, points in zip(self._sampled, (self.null, self.moving), strict=True)
        )
        return null, moving

    def open_loops(self, controller: Controller, f: np.ndarray) -> np.ndarray:
        """At null, broken at the command: loops [lanes, k] at frequencies [k], Hz. Raises InputError as `margins`."""
        null = self._sampled[0]
        return LoopLanes(null, lane_laws(controller, null.signals)).at(np.arange(len(self.p)), f[None])

    def linear(self, controller: Controller) -> "LinearLanes":
        """Margins as `margins` has them, and responses at null. Raises InputError as `margins`."""
        views = [lane_views(controller, sampled.signals) for sampled in self._sampled]
        null, moving = (LoopLanes(sampled, view.of_loop()) for sampled, view in zip(self._sampled, views, strict=True))
        opened = null.opened(np.arange(len(self.p)))
        curves = [_smooth(null, lane, *opened.curve(lane)) for lane in range(len(self.p))]
        closed = closed_response(self._sampled[0], views[0].view(0, self.rig.period.value), *curves[0])
        margins = null.margins(opened).where(self.null.ok, _NONE), moving.margins().where(self.moving.ok, _NONE)
        return LinearLanes(*margins, curves, closed)

    def some(self, lanes: Sequence[int]) -> "PlantLanes":
        """Some of them."""
        index = np.asarray(lanes, int)
        null, moving = (Equilibria(at.x[index], at.u[index], at.ok[index]) for at in (self.null, self.moving))
        names = tuple(self.names[lane] for lane in lanes)
        return PlantLanes(self.rig, self.engine, names, self.p[index], self.position[index], null, moving)

    @cached_property
    def _sampled(self) -> tuple[SampledLanes, SampledLanes]:
        """Linearised at both points, from the command to every sensor."""
        plant, period = self.engine.plant, self.rig.period.value
        measures = tuple(name for name in plant.outputs if name in self.rig.sensors)
        smooth = plant.without_dry_friction(self.p)
        null, moving = (sampled_lanes(plant, at, smooth, measures, period) for at in (self.null, self.moving))
        return null, moving


def plant_lanes(rig: Rig, engine: Engine, names: Sequence[str], p: np.ndarray, position: np.ndarray) -> PlantLanes:
    """Plants with their operating points, specimens relaxed there. Raises InputError where the nominal one has none."""
    null = equilibria(engine.plant, p, position, None, None, **far_end(engine.plant, position))
    smooth = engine.plant.without_dry_friction(p)
    _, speed = moving_point(engine.plant, rig.passing_speed, p=engine.plant.without_dry_friction())
    moving = equilibria(engine.plant, smooth, position, speed, None, **far_end(engine.plant, position, speed))
    return PlantLanes(rig, engine, tuple(names), p, position, null, moving)


def _smooth(loops: LoopLanes, lane: int, f: np.ndarray, loop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A lane's loop [k] over f [k] in Hz, with further points where it goes far from one to the next."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        far = np.nan_to_num(np.abs(np.log(loop[1:] / loop[:-1])), posinf=np.inf) / _NEAR
    more = np.minimum(np.floor(far), _MOST).astype(int)
    i = np.repeat(np.arange(len(more)), more)
    part = (np.arange(len(i)) - np.repeat(np.cumsum(more) - more, more) + 1) / (more[i] + 1)
    between = f[i] * (f[i + 1] / f[i]) ** part
    f, loop = np.append(f, between), np.append(loop, loops.at(np.array([lane]), between[None])[0])
    order = np.argsort(f, kind="stable")
    return f[order], loop[order]


def joined(first: PlantLanes, second: PlantLanes) -> PlantLanes:
    """Lanes of one structure behind each other."""
    null, moving = (
        Equilibria(*(np.concatenate(columns) for columns in ((a.x, b.x), (a.u, b.u), (a.ok, b.ok))))
        for a, b in ((first.null, second.null), (first.moving, second.moving))
    )
    p, position = np.concatenate((first.p, second.p)), np.concatenate((first.position, second.position))
    return PlantLanes(first.rig, first.engine, (*first.names, *second.names), p, position, null, moving)


def drawn_evenly(random: np.random.Generator, low: float, high: float, count: int) -> np.ndarray:
    """Numbers [count] even from low to high; where high is five times as much and more, even in their logarithm.

    Each takes one draw of the generator.
    """
    if high >= _WIDE * low > 0:
        return np.exp(random.uniform(np.log(low), np.log(high), count))
    return random.uniform(low, high, count)


def uncertain(rig: Rig, plant: Plant, factors: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """What is uncertain of a rig and its effects, [low, high] by name, SI: factors on numbers, and every other that has
    bounds or, once fitted, an interval."""
    ranges = {}
    for name, number in numbers_of(rig).items():
        ends = number.uncertain
        if name in factors:
            low, high = factors[name]
            ends = low * number.value, high * number.value
        if ends is not None and name in plant.parameters:
            ranges[name] = ends
    return ranges
