"""Closed loops in lanes of a controller that computes in Python: one call a period for all of them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np

from ..control.linear_law import LinearLaw, static
from ..control.protocol import Controller, LaneController, lane_controller, preview, sampled_law
from ..engine import Engine
from ..engine.sampled_law import OUT
from ..linear.equilibria import Equilibria
from ..rigs.rig import Rig
from .batch import LaneChunk, Lanes, chunks, run_lanes
from .compiled_loop import CompiledLaw, compiled_law
from .sensors import Sensors, check_sensors

_STOPPED = 1  # of a lane that could not be simulated: as if its guard had tripped


def plays_in_lanes(controller: Controller) -> bool:
    """Whether a controller is data, a graph, or has a form in lanes."""
    return sampled_law(controller) is not None or lane_controller(controller) is not None


def play_lanes(
    engine: Engine,
    rig: Rig,
    controller: Controller,
    points: Equilibria,
    p: np.ndarray,
    reference: np.ndarray,
    recorded: tuple[str, ...],
    seed: int | None = None,
    inputs: Mapping[str, np.ndarray] | None = None,
    first: int = 0,
) -> Iterator[tuple[slice, Lanes]]:
    """`run_lanes` of a controller: compiled where it is data or a graph, else by its form in lanes, period by period.

    Raises ValueError for a controller that has neither.
    """
    law, lanes = sampled_law(controller), lane_controller(controller)
    if law is not None:
        yield from run_lanes(engine, rig, law, points, p, reference, recorded, seed, inputs, first)
    elif lanes is not None:
        check_sensors(rig, controller.measures)
        sensors = Sensors(rig, engine.plant.outputs, seed)
        silent = static([0.0, 0.0], controller.measures[:1])  # what the controller demands is added to nothing
        ready = partial(compiled_law, engine, rig, [silent], sensors, recorded=recorded)
        loops = _LaneLoops(engine, ready, silent, lanes, preview(controller), sensors)
        for part, chunk in chunks(engine, sensors, points, p, reference, seed, inputs or {}, first):
            yield part, loops.run(chunk)
    else:
        raise ValueError(f"{type(controller).__name__} has no form in lanes")


@dataclass(frozen=True)
class _LaneLoops:
    """A controller in lanes, and how many samples `ahead` it knows its reference.

    `ready`: guard, drive and sensors as a compiled loop of the `silent` law has them, of plants with parameters
    [lanes, j].
    """

    engine: Engine
    ready: Callable[[np.ndarray], CompiledLaw]
    silent: LinearLaw
    lanes: LaneController
    ahead: int
    sensors: Sensors

    def run(self, chunk: LaneChunk) -> Lanes:
        """All instants of a chunk."""
        controlled = self.silent.measures[0]
        level = chunk.outputs[:, [self.engine.plant.output(controlled)]]
        asked = np.pad(level + chunk.reference, ((0, 0), (0, self.ahead)), "edge").T
        measured = self._read(chunk.outputs, chunk.normal[:, 0])
        self.lanes.reset(measured[controlled], measured, chunk.points.u[:, 0].copy())
        plants = _Plants(self.engine, self.ready(chunk.p), self.silent, chunk)
        for i in range(chunk.reference.shape[1]):
            measured = self._read(plants.outputs(i), chunk.normal[:, i + 1])
            if self.ahead:
                cast(Any, self.lanes).set_preview(asked[i : i + self.ahead + 1])
            sent, tripped = plants.advance(i, asked[i], self.lanes.compute(asked[i], measured))
            if tripped.any():
                self.lanes.stop(tripped)
            self.lanes.update(sent)
        return plants.record()

    def _read(self, outputs: np.ndarray, normal: np.ndarray) -> dict[str, np.ndarray]:
        return dict(zip(self.sensors.names, self.sensors.readings(outputs, normal).T, strict=True))


class _Plants:
    """The plants of a chunk behind their guards and drives."""

    def __init__(self, engine: Engine, ready: CompiledLaw, silent: LinearLaw, chunk: LaneChunk) -> None:
        self._engine, self._ready, self._start, self._p = engine, ready, chunk.points, chunk.p
        lanes, k = chunk.reference.shape
        rows = np.concatenate((np.zeros((lanes, k, 2)), chunk.others, chunk.normal[:, 1:]), axis=2)
        self._rows = rows.swapaxes(0, 1).copy()  # [k, lanes, j], references and commands 0 until they are known
        self._x, self._u = chunk.points.x, chunk.points.u.copy()
        self._state = ready.start([np.zeros(0)] * lanes, chunk.points.u[:, :1])
        self._numbers = ready.numbers([silent], np.zeros(lanes))
        self._held, self._trip = ready.shape.state["held"].start, ready.shape.trip
        self._others = ready.shape.inputs(engine.plant)["others"]
        self._out = np.empty((k, lanes, len(OUT) + len(ready.shape.recorded)))
        self._failed = np.zeros(lanes, bool)

    def outputs(self, i: int) -> np.ndarray:
        """The outputs [lanes, h] at instant i."""
        self._u[:, 0], self._u[:, 1:] = self._state[:, self._held], self._rows[i, :, self._others]
        return self._engine.outputs(self._x[:, None], self._u[:, None], self._p[:, None])[:, 0]

    def advance(self, i: int, reference: np.ndarray, demanded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Go on by one period with references and demanded commands [lanes]; the commands that were sent, and which
        lanes have tripped.

        A lane that cannot be simulated goes on at rest, tripped, and has no signals.
        """
        ready, rows = self._ready, self._rows[i]
        rows[:, 0], rows[:, 1] = reference, demanded
        batch, out = self._engine.run_sampled(
            ready.shape, self._x, ready.durations, self._state, rows[:, None], self._numbers, p=self._p
        )
        self._x, out = batch.x[:, 1], out[:, 0]
        self._out[i] = np.where(self._failed[:, None], np.nan, out)
        if not batch.ok.all():
            self._rest(~batch.ok)
        return out[:, 0], self._state[:, self._trip] > 0

    def _rest(self, failed: np.ndarray) -> None:
        self._failed = self._failed | failed
        self._x = np.where(failed[:, None], self._start.x, self._x)
        self._state[failed, self._trip] = _STOPPED

    def record(self) -> Lanes:
        """What they did."""
        return Lanes.of(self._out.swapaxes(0, 1), self._ready.shape.recorded, self._failed)
