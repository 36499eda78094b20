"""Plants in lanes with their operating points: what loops of all designs on many plants share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..control.protocol import Controller, linear_view
from ..engine import Engine
from ..linear.equilibria import Equilibria, equilibria
from ..linear.operating_point import far_end
from ..linear.state_space import sampled_response
from ..plant import Plant
from ..rigs.rig import Rig
from .lane_laws import lane_laws, signals_at
from .lane_margins import LaneMargins, SampledLanes, lane_margins, open_loops, sampled_lanes
from .plant_response import near
from .rows import MOVING

_NONE = 2.0  # radius [1] of a loop on a plant without an operating point: finite, so that searches can compare
_LIGHT, _TINY = 0.15, 1e-300  # damping below which a resonance is sharp
_WIDE = 5.0  # high over low: from there on a range is one of orders of magnitude


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

    def margins(self, controller: Controller) -> tuple[LaneMargins, LaneMargins]:
        """The linear loops of a controller at null and moving; a plant without such a point counts as unstable.

        Raises InputError where the controller has no linear view.
        """
        null, moving = (
            lane_margins(sampled, lane_laws(controller, signals_at(self.engine, points, self._smooth))).where(
                points.ok, _NONE
            )
            for sampled, points in zip(self._sampled, (self.null, self.moving), strict=True)
        )
        return null, moving

    def open_loops(self, controller: Controller, f: np.ndarray) -> np.ndarray:
        """At null, broken at the command: loops [lanes, k] at frequencies [k], Hz. Raises InputError as `margins`."""
        law = lane_laws(controller, signals_at(self.engine, self.null, self._smooth))
        return open_loops(self._sampled[0], law, f)

    def closed_loop(self, controller: Controller, f: np.ndarray, lane: int = 0) -> np.ndarray:
        """One lane at null: reference -> controlled signal, complex [k] at frequencies [k], Hz.

        Raises NoLinearView for a controller without a linear view. An unstable loop has a response that none can see.
        """
        sampled, z = self._sampled[0], np.exp(2j * np.pi * f * self.rig.period.value)
        points = signals_at(self.engine, self.null, self._smooth)
        law = linear_view(controller, {name: float(values[lane]) for name, values in points.items()})
        gains = sampled_response(law, z)[0]
        rows = [sampled.measures.index(name) for name in law.input_labels[1:]]
        measured = sampled.modal.some(np.array([lane]), rows).at(z)[0]
        return gains[0] * measured[0] / (1 - np.sum(gains[1:] * measured, axis=0))

    @cached_property
    def sharp_frequencies(self) -> np.ndarray:
        """Frequencies [k] in Hz about those at which a plant at null resonates lightly damped."""
        modes = self._sampled[0].modal.modes.ravel()
        light = modes[np.abs(np.log(np.abs(modes) + _TINY)) < _LIGHT * np.abs(np.angle(modes))]
        return near(light, self.rig.period.value)

    def some(self, lanes: Sequence[int]) -> "PlantLanes":
        """Some of them."""
        index = np.asarray(lanes, int)
        null, moving = (Equilibria(at.x[index], at.u[index], at.ok[index]) for at in (self.null, self.moving))
        names = tuple(self.names[lane] for lane in lanes)
        return PlantLanes(self.rig, self.engine, names, self.p[index], self.position[index], null, moving)

    @cached_property
    def _smooth(self) -> np.ndarray:
        return self.engine.plant.without_dry_friction(self.p)

    @cached_property
    def _sampled(self) -> tuple[SampledLanes, SampledLanes]:
        """Linearised at both points, from the command to every sensor."""
        plant, period = self.engine.plant, self.rig.period.value
        measures = tuple(name for name in plant.outputs if name in self.rig.sensors)
        null, moving = (sampled_lanes(plant, at, self._smooth, measures, period) for at in (self.null, self.moving))
        return null, moving


def plant_lanes(rig: Rig, engine: Engine, names: Sequence[str], p: np.ndarray, position: np.ndarray) -> PlantLanes:
    """Plants with their operating points, specimens relaxed there. Raises InputError where the nominal one has none."""
    null = equilibria(engine.plant, p, position, None, None, **far_end(engine.plant, position))
    smooth = engine.plant.without_dry_friction(p)
    moving = equilibria(engine.plant, smooth, position, MOVING, None, **far_end(engine.plant, position, MOVING))
    return PlantLanes(rig, engine, tuple(names), p, position, null, moving)


def joined(first: PlantLanes, second: PlantLanes) -> PlantLanes:
    """Lanes of one structure behind each other."""
    null, moving = (
        Equilibria(*(np.concatenate(columns) for columns in ((a.x, b.x), (a.u, b.u), (a.ok, b.ok))))
        for a, b in ((first.null, second.null), (first.moving, second.moving))
    )
    p, position = np.concatenate((first.p, second.p)), np.concatenate((first.position, second.position))
    return PlantLanes(first.rig, first.engine, (*first.names, *second.names), p, position, null, moving)


def drawn_evenly(random: np.random.Generator, low: float, high: float, count: int) -> np.ndarray:
    """Numbers [count] even from low to high; where high is five times as much and more, even in their logarithm."""
    if high >= _WIDE * low > 0:
        return np.exp(random.uniform(np.log(low), np.log(high), count))
    return random.uniform(low, high, count)


def uncertain(rig: Rig, plant: Plant, factors: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """What is uncertain of a rig, [low, high] by name, SI: factors on numbers, and every other that has bounds or, once
    fitted, an interval."""
    ranges = {}
    for name, number in rig.numbers.items():
        ends = number.uncertain
        if name in factors:
            low, high = factors[name]
            ends = low * number.value, high * number.value
        if ends is not None and name in plant.parameters:
            ranges[name] = ends
    return ranges
