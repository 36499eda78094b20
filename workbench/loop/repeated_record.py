"""A record that a loop plays again and again, each time from rest where it starts, with noise of its own: on one plant,
or on many at once, each a lane.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..engine import Engine
from ..linear.equilibria import Equilibria, equilibria
from ..linear.operating_point import far_end
from ..rigs.rig import Rig
from . import step_metrics as metrics
from .batch import CHUNK, play_lanes
from .learning import Iteration, PlayedLanes
from .metrics import chamber_row
from .rows import LoopSetup
from .sampled_loop import SampledLoop
from .scenarios import Scenario
from .sensors import logged, logged_lanes


def faded(scenario: Scenario, rest: float, fade: float, period: float) -> np.ndarray:
    """A scenario's course [k], from the start, with `rest` [s] before and after, faded in and out over `fade` [s]."""
    t = np.arange(round((scenario.duration + 2 * rest) / period) + 1) * period - rest
    inside = np.clip(t, 0.0, scenario.duration)
    course = scenario.reference(inside)
    if not fade:
        return course
    share = np.clip(np.minimum(inside, scenario.duration - inside) / fade, 0.0, 1.0)
    return np.sin(np.pi / 2 * share) ** 2 * course


def noise_seed(seed: int | None, number: int) -> int | None:
    """The seed of the noise of the nth time, from -2, that a record is played."""
    return None if seed is None else int(np.random.SeedSequence([seed, number + 2]).generate_state(1)[0])


@dataclass(frozen=True)
class RepeatedRecord:
    """A controller that plays drive files of a signal where a scenario starts; `seed` is that of its sensors' noise."""

    spec: ControllerSpec
    scenario: Scenario
    setup: LoopSetup
    seed: int | None

    @property
    def level(self) -> float:
        """The controlled signal at the start (SI): drives are deviations from it."""
        plant, start = self.setup.engine.plant, self.setup.where(self.scenario).null
        return float(self.setup.engine.observe(start.x, start.u)[plant.output(self.scenario.signal)])

    def play(self, number: int, drive: np.ndarray, gain: float) -> Iteration:
        """The nth time, from -2: another drive [k], and other noise. `gain` is that by which it was corrected."""
        seed = noise_seed(self.seed, number)
        setup, start = self.setup, self.setup.where(self.scenario).null
        controller = self.spec.build(setup.rig.period.value)
        run = SampledLoop(setup.engine, setup.rig, controller, start, seed).run(self.level + drive)
        signals, name = run.record.signals, self.scenario.signal
        return Iteration(
            drive,
            signals[name] - self.level,
            logged(signals, setup.rig, setup.engine.plant.outputs, seed)[name] - self.level,
            signals["command"],
            metrics.saturated_time(run.record.t, run.demanded, signals["command"]),
            chamber_row(run.record.t, signals.get("lowest_pressure")),
            run.tripped,
            gain,
        )


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
