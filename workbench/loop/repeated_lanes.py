"""A record that a loop plays again and again on many plants at once, each a lane with noise of its own."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..engine import Engine
from ..linear.equilibria import Equilibria, equilibria
from ..linear.operating_point import far_end
from ..rigs.rig import Rig
from .batch import CHUNK, play_lanes
from .repeated_record import noise_seed
from .sensors import logged_lanes


@dataclass(frozen=True, eq=False)
class PlayedLanes:
    """What the controlled signal did and what its sensor said [lanes, k], from the start; which lanes tripped [lanes].

    A lane that could not be simulated counts as tripped.
    """

    true: np.ndarray
    measured: np.ndarray
    tripped: np.ndarray


@dataclass(frozen=True, eq=False)
class RepeatedLanes:
    """A controller that plays drives of a signal on plants with parameters p [lanes, j], each from rest at its point.

    At most `CHUNK` of them; `seed` is that of their sensors' noise.
    """

    rig: Rig
    engine: Engine
    spec: ControllerSpec
    signal: str
    points: Equilibria
    p: np.ndarray
    seed: int | None

    def play(self, number: int, drive: np.ndarray, lanes: np.ndarray) -> PlayedLanes:
        """The nth time, as in RepeatedRecord, on some `lanes` [n]: drives [k] or [n, k], from the start."""
        points = Equilibria(self.points.x[lanes], self.points.u[lanes], self.points.ok[lanes])
        seed = noise_seed(self.seed, number)
        controller = self.spec.build(self.rig.period.value)
        ((_, played),) = play_lanes(
            self.engine, self.rig, controller, points, self.p[lanes], drive, (self.signal,), seed
        )
        y = played.signals[self.signal]
        measured = logged_lanes(y, self.signal, self.rig, self.engine.plant.outputs, seed)
        return PlayedLanes(y - y[:, :1], measured - y[:, :1], (played.trip > 0) | played.failed | ~points.ok)


def repeated_lanes(
    rig: Rig, engine: Engine, spec: ControllerSpec, signal: str, p: np.ndarray, position: np.ndarray, seed: int | None
) -> Iterator[RepeatedLanes]:
    """Plants p [plants, j] at rest at positions [plants], m from mid stroke, `CHUNK` at a time, each with other noise.

    Specimens are relaxed there. Raises InputError where the nominal plant has no operating point.
    """
    for first in range(0, len(p), CHUNK):
        part = slice(first, first + CHUNK)
        points = equilibria(engine.plant, p[part], position[part], None, None, **far_end(engine.plant, position[part]))
        own = seed if seed is None or not first else noise_seed(seed, first)
        yield RepeatedLanes(rig, engine, spec, signal, points, p[part], own)
