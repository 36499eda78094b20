"""Closed loops in lanes of a controller that computes in Python: one call a period for all of them."""

from collections.abc import Iterator, Mapping
from typing import Any, cast

import numpy as np

from ..control.linear_law import static
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
) -> Iterator[tuple[slice, Lanes]]:
    """`run_lanes` of a controller: compiled where it is data or a graph, else by its form in lanes, period by period.

    Raises ValueError for a controller that has neither.
    """
    law, lanes = sampled_law(controller), lane_controller(controller)
    if law is not None:
        yield from run_lanes(engine, rig, law, points, p, reference, recorded, seed, inputs)
    elif lanes is not None:
        check_sensors(rig, controller.measures)
        sensors = Sensors(rig, engine.plant.outputs, seed)
        loops = _LaneLoops(engine, rig, lanes, controller, sensors, recorded)
        for part, chunk in chunks(engine, sensors, points, p, reference, seed, inputs or {}):
            yield part, loops.run(chunk)
    else:
        raise ValueError(f"{type(controller).__name__} has no form in lanes")


class _LaneLoops:
    """A controller in lanes on a plant. Guard, delay and plant are those of the compiled loop, whose law is "what the
    controller demands": u = r."""

    def __init__(
        self,
        engine: Engine,
        rig: Rig,
        lanes: LaneController,
        controller: Controller,
        sensors: Sensors,
        recorded: tuple[str, ...],
    ) -> None:
        self._engine, self._lanes, self._sensors = engine, lanes, sensors
        self._law = static([1.0, 0.0], ("position",))
        self._ready: CompiledLaw = compiled_law(engine, rig, [self._law], sensors, recorded)
        self._controlled, self._ahead = controller.measures[0], preview(controller)

    def run(self, chunk: LaneChunk) -> Lanes:
        """All instants of a chunk."""
        (lanes, k), start, plant = chunk.reference.shape, chunk.points, self._engine.plant
        level = chunk.outputs[:, [plant.output(self._controlled)]]
        asked = np.pad(level + chunk.reference, ((0, 0), (0, self._ahead)), "edge").T
        measured = self._read(chunk.outputs, chunk.normal[:, 0])
        self._lanes.reset(measured[self._controlled], measured, start.u[:, 0].copy())
        rows = np.concatenate((np.zeros((lanes, k, 2)), chunk.others, chunk.normal[:, 1:]), axis=2)
        plants = _Plants(self._engine, self._ready, self._law, chunk, rows.swapaxes(0, 1).copy())
        for i in range(k):
            measured = self._read(plants.outputs(i), chunk.normal[:, i + 1])
            if self._ahead:
                cast(Any, self._lanes).set_preview(asked[i : i + self._ahead + 1])
            sent, stopped = plants.advance(i, self._lanes.compute(asked[i], measured))
            if stopped.any():
                self._lanes.stop(stopped)
            self._lanes.update(sent)
        return plants.lanes()

    def _read(self, outputs: np.ndarray, normal: np.ndarray) -> dict[str, np.ndarray]:
        return dict(zip(self._sensors.names, self._sensors.readings(outputs, normal).T, strict=True))


class _Plants:
    """Plants in lanes behind their guards and drives; rows [k, lanes, j] of their instants, without the commands."""

    def __init__(self, engine: Engine, ready: CompiledLaw, law: Any, chunk: LaneChunk, rows: np.ndarray) -> None:
        self._engine, self._ready, self._start, self._p, self._rows = engine, ready, chunk.points, chunk.p, rows
        lanes, command = len(chunk.p), chunk.points.u[:, :1]
        self._x, self._u = chunk.points.x, chunk.points.u.copy()
        self._state = ready.start([np.zeros(0)] * lanes, command)
        self._numbers = ready.numbers([law], np.zeros(lanes))
        self._held, self._trip = ready.shape.state["held"].start, ready.shape.state["trip"].start
        self._out = np.full((len(rows), lanes, len(OUT) + len(ready.shape.recorded)), np.nan)
        self._failed = np.zeros(lanes, bool)
        self._others = ready.shape.inputs(engine.plant)["others"]

    def outputs(self, i: int) -> np.ndarray:
        """The outputs [lanes, h] at instant i."""
        self._u[:, 0], self._u[:, 1:] = self._state[:, self._held], self._rows[i, :, self._others]
        return self._engine.outputs(self._x[:, None], self._u[:, None], self._p[:, None])[:, 0]

    def advance(self, i: int, demanded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Go on by one period with demanded commands [lanes]; those that were sent, and which lanes have tripped.

        A lane that cannot be simulated goes on at rest, tripped, and has no signals.
        """
        ready, rows = self._ready, self._rows[i]
        rows[:, 0] = demanded
        batch, out = self._engine.run_sampled(
            ready.shape, self._x, ready.durations, self._state, rows[:, None], self._numbers, p=self._p
        )
        self._x, out = batch.x[:, 1], out[:, 0]
        self._out[i, ~self._failed] = out[~self._failed]
        if not batch.ok.all():
            self._stop(~batch.ok)
        return out[:, 0], self._state[:, self._trip] > 0

    def _stop(self, failed: np.ndarray) -> None:
        self._failed = self._failed | failed
        self._x = np.where(failed[:, None], self._start.x, self._x)
        self._state[failed, self._trip] = _STOPPED

    def lanes(self) -> Lanes:
        """What they did."""
        columns = dict(zip((*OUT, *self._ready.shape.recorded), np.moveaxis(self._out, 2, 0), strict=True))
        columns = {name: column.T for name, column in columns.items()}
        trips = np.nan_to_num(columns["trip"]).max(axis=1)
        signals = {name: columns[name] for name in self._ready.shape.recorded}
        return Lanes(signals, columns["sent"], columns["demanded"], trips, self._failed)
