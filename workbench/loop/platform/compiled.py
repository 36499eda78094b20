"""A platform's loop compiled: plant, laws and guards in one run of the engine, alone or in lanes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...control.platform_controller import LEGS
from ...control.platform_law import PlatformLaw
from ...engine import Batch, periods
from ...engine.guard_shape import length, packed
from ...engine.platform_instants import OUT, PlatformShape
from ..guard_numbers import guard_numbers, guard_shape, trip_reason
from ..sampled_loop import SIMULATION_FAILED
from .legs import Inputs, Instants, LegSensors
from .setup import PlatformSetup


@dataclass(frozen=True, eq=False)
class CompiledPlatform:
    """A platform with its sensors, six guards and a law, ready to run in lanes.

    Between runs a lane is its state of the plant x [n] and its `memory`: the commands on their way, the guards and the
    law.
    """

    setup: PlatformSetup
    sensors: LegSensors
    law: PlatformLaw

    @cached_property
    def shape(self) -> PlatformShape:
        """What the machine code is of."""
        plant = self.setup.engine.plant
        guard = guard_shape(self.setup.guarded[0], self.sensors.names, self.law.measures)
        drive = self._whole, bool(self._part) and not plant.interpolated, plant.interpolated
        return PlatformShape(self.law.graphs, self.law.measures, self.sensors.names, guard, *drive, self.sensors.noisy)

    def memory(self, command: np.ndarray, law: np.ndarray) -> np.ndarray:
        """Of a lane whose drives have held commands [6] for long and whose law is in this state."""
        shape = self.shape
        guard = np.zeros(LEGS * length(shape.guard.state))
        line = np.tile(command, shape.late + 1)
        return packed(shape.state, held=command, line=line, command=command, guard=guard, law=law)

    def numbers(self, offset: np.ndarray) -> np.ndarray:
        """Of law, guards and sensors, one leg after the other; `offset` [6]: with which the law begins."""
        shape, guard = self.shape, self.shape.guard
        read = self.sensors.picked(guard.read)
        guards = [
            packed(guard.numbers, **guard_numbers(rig, guard, shape.measured, self.sensors.noisy))
            for rig in self.setup.guarded
        ]
        noise, resolution = (part[:, read].ravel() for part in (self.sensors.noise, self.sensors.resolution))
        legs = {"guard": np.concatenate(guards), "noise": noise, "resolution": resolution}
        return packed(shape.numbers, q=self.law.numbers, offset=offset, part=self._part, **legs)

    def rows(self, **columns: np.ndarray) -> np.ndarray:
        """Rows of instants [.., k, inputs] of `reference`, `forward`, `others` and, where sensors are noisy, `noise`,
        each [.., k, own]."""
        return packed(self.shape.inputs(self.setup.engine.plant), **columns)

    def run(
        self, x: np.ndarray, memory: np.ndarray, rows: np.ndarray, numbers: np.ndarray, p: np.ndarray | None = None
    ) -> tuple[Batch, dict[str, np.ndarray]]:
        """Lanes from x [lanes, n] along rows [lanes, k, inputs]; `memory` [lanes, own] changes in place. States as in
        Engine.run_batch, and what each instant put out, by the names of OUT, [lanes, k, 6]."""
        durations = np.array([self._part, 1 - self._part] if self.shape.split else [1.0]) * self.setup.platform.period
        batch, out = self.setup.engine.run_sampled(self.shape, x, durations, memory, rows, numbers, p=p)
        return batch, dict(zip(OUT, np.split(out, len(OUT), axis=2), strict=True))

    def trip(self, codes: np.ndarray) -> str | None:
        """Why the first of the legs that tripped did, in words, of the codes of all [6]."""
        legs = np.flatnonzero(codes)
        rig = self.setup.guarded[legs[0]] if len(legs) else None
        return None if rig is None else f"leg {legs[0] + 1}: {trip_reason(rig, int(codes[legs[0]]))}"

    @property
    def _whole(self) -> int:
        return periods(self.setup.engine.plant.lateness(), self.setup.platform.period)[0]

    @property
    def _part(self) -> float:
        return periods(self.setup.engine.plant.lateness(), self.setup.platform.period)[1]


def run_compiled(setup: PlatformSetup, sensors: LegSensors, law: PlatformLaw, inputs: Inputs) -> Instants:
    """The loop of a law along its inputs, from the setup's operating point."""
    loop, start = CompiledPlatform(setup, sensors, law), setup.null
    first = sensors.read(setup.engine.observe(start.x, start.u), inputs.normal[0])
    signals = np.concatenate((inputs.reference[0], inputs.forward[0], first[:, sensors.picked(law.measures)].ravel()))
    x, offset = law.start(signals, start.u[:LEGS])
    noise = {"noise": inputs.normal[1:]} if sensors.noisy else {"noise": inputs.normal[1:, :0]}
    rows = loop.rows(reference=inputs.reference, forward=inputs.forward, others=inputs.others, **noise)
    memory = loop.memory(start.u[:LEGS], x)[None].copy()
    batch, out = loop.run(start.x[None], memory, rows[None], loop.numbers(offset)[None])
    failed = int(batch.failed[0])
    k = len(rows) if failed < 0 else failed + 1
    reason = loop.trip(out["trip"][0, k - 1]) if failed < 0 else SIMULATION_FAILED
    return Instants(batch.x[0, :k], out["held"][0, :k], out["sent"][0, :k], out["demanded"][0, :k], reason)
