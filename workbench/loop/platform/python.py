"""A platform's loop in Python: what laws without a graph run in, and the oracle of the compiled one.

Its guards are those of the compiled loop, evaluated sample by sample.
"""

from collections.abc import Mapping

import numpy as np

from ...control.platform_controller import LEGS, PlatformController
from ...control.platform_law import direct_law
from ...engine import DelayLine
from ...engine.buffered import BufferedFunction
from ...engine.guard_shape import length
from ...engine.instant import controller_instant
from ..sampled_loop import SIMULATION_FAILED
from .compiled import CompiledPlatform
from .legs import Inputs, Instants, LegSensors
from .setup import PlatformSetup


def run_in_python(
    setup: PlatformSetup, sensors: LegSensors, controller: PlatformController, inputs: Inputs
) -> Instants:
    """The loop of a controller along its inputs, from the setup's operating point."""
    engine, period = setup.engine, setup.platform.period
    x, u = setup.null.x.copy(), setup.null.u.copy()
    commands = u[:LEGS].copy()
    guards = _Guards(CompiledPlatform(setup, sensors, direct_law(controller.measures)), commands)
    line = DelayLine(engine.plant.lateness(), period, commands, engine.plant.interpolated)
    controller.reset(inputs.reference[0], sensors.named(engine.observe(x, u), inputs.normal[0]), commands)
    rows: list[tuple[np.ndarray, ...]] = []
    reason = None
    for k, (reference, forward, others) in enumerate(zip(inputs.reference, inputs.forward, inputs.others, strict=True)):
        u[LEGS:] = others
        measured = sensors.named(engine.observe(x, u), inputs.normal[k + 1])
        demanded = np.zeros(LEGS) if guards.trips.any() else controller.compute(reference, measured, forward)
        sent, demanded = guards.sample(reference, demanded, measured)
        if not guards.trips.any():
            controller.update(sent)
        arriving = line.send(sent)
        rows.append((x, arriving[0][0], sent, demanded))
        after = engine.advance_arriving(x, u, arriving, period)
        if after is None:
            reason = SIMULATION_FAILED
            break
        x = after
    states, held, every, asked = (np.array(column) for column in zip(*rows, strict=True))
    return Instants(states, held, every, asked, reason or guards.reason)


class _Guards:
    """Six guards, from where the drives hold commands [6]."""

    def __init__(self, loop: CompiledPlatform, commands: np.ndarray) -> None:
        self._loop, self.trips = loop, np.zeros(LEGS)
        self._state = loop.memory(commands, np.zeros(0))
        self._read, self._row = loop.shape.read, np.zeros(LEGS * (2 + len(loop.shape.read)))
        numbers = np.ascontiguousarray(loop.numbers(np.zeros(LEGS)))
        self._instant = BufferedFunction(controller_instant(loop.shape), self._state, self._row, numbers)

    @property
    def reason(self) -> str | None:
        """Why they tripped, if they did."""
        return self._loop.trip(self.trips)

    def sample(
        self, reference: np.ndarray, demanded: np.ndarray, measured: Mapping[str, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Commands [6] that the drives get, and those demanded, 0 once one guard tripped."""
        readings = np.column_stack([measured[name] for name in self._read])
        self._row[:] = np.concatenate((reference, demanded, readings.ravel()))
        self._instant.evaluate()
        states = length(self._loop.shape.state)
        self._state[:] = self._instant.found[:states]
        sent, demanded, self.trips = self._instant.found[states:].copy().reshape(3, LEGS)
        return sent, demanded
