"""A platform's loop compiled: plant, laws and guards in one run of the engine."""

from collections.abc import Mapping

import numpy as np

from ...control.platform_controller import LEGS
from ...control.platform_law import PlatformLaw
from ...engine import periods
from ...engine.guard_shape import length, packed
from ...engine.platform_instants import PlatformShape
from ..guard_numbers import guard_numbers, guard_shape, trip_reason
from ..sampled_loop import SIMULATION_FAILED
from .legs import Inputs, Instants, LegSensors
from .setup import PlatformSetup


def run_compiled(setup: PlatformSetup, sensors: LegSensors, law: PlatformLaw, inputs: Inputs) -> Instants:
    """The loop of a law along its inputs, from the setup's operating point."""
    plant, start = setup.engine.plant, setup.null
    whole, part = periods(plant.lateness(), setup.platform.period)
    split = bool(part) and not plant.interpolated
    guard = guard_shape(setup.guarded[0], sensors.names, law.measures)
    drive = whole, split, plant.interpolated
    shape = PlatformShape(law.graphs, law.measures, sensors.names, guard, *drive, sensors.noisy)
    durations = np.array([part, 1 - part] if split else [1.0]) * setup.platform.period
    first = sensors.read(setup.engine.observe(start.x, start.u), inputs.normal[0])
    signals = np.concatenate((inputs.reference[0], inputs.forward[0], first[:, sensors.picked(law.measures)].ravel()))
    x, offset = law.start(signals, start.u[:LEGS])
    state = packed(shape.state, **_at_start(shape, start.u[:LEGS], x))[None].copy()
    parameters = packed(shape.numbers, q=law.numbers, offset=offset, part=part, **_legs(setup, sensors, shape))[None]
    columns = (inputs.reference, inputs.forward, inputs.others, *((inputs.normal[1:],) if sensors.noisy else ()))
    rows = np.hstack(columns)[None]
    batch, out = setup.engine.run_sampled(shape, start.x[None], durations, state, rows, parameters)
    sent, demanded, held, trips = np.split(out[0], 4, axis=1)
    failed = int(batch.failed[0])
    k = len(rows[0]) if failed < 0 else failed + 1
    reason = _reason(setup, trips[k - 1]) if failed < 0 else SIMULATION_FAILED
    return Instants(batch.x[0, :k], held[:k], sent[:k], demanded[:k], reason)


def _at_start(shape: PlatformShape, command: np.ndarray, law: np.ndarray) -> dict[str, np.ndarray]:
    """The parts of the state of an instant where the drives hold commands [6]."""
    guard = np.zeros(LEGS * length(shape.guard.state))
    line = np.tile(command, shape.late + 1)
    return {"held": command, "line": line, "command": command, "guard": guard, "law": law}


def _legs(setup: PlatformSetup, sensors: LegSensors, shape: PlatformShape) -> Mapping[str, np.ndarray]:
    """The numbers of guards and sensors, one leg after the other."""
    guard, read = shape.guard, sensors.picked(shape.guard.read)
    numbers = [
        packed(guard.numbers, **guard_numbers(rig, guard, shape.measured, sensors.noisy)) for rig in setup.guarded
    ]
    noise, resolution = (part[:, read].ravel() for part in (sensors.noise, sensors.resolution))
    return {"guard": np.concatenate(numbers), "noise": noise, "resolution": resolution}


def _reason(setup: PlatformSetup, trips: np.ndarray) -> str | None:
    legs = np.flatnonzero(trips)
    return f"leg {legs[0] + 1}: {trip_reason(setup.guarded[legs[0]], int(trips[legs[0]]))}" if len(legs) else None
