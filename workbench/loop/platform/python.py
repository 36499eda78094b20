"""A platform's loop in Python: what laws without a graph run in, and the oracle of the compiled one."""

import numpy as np

from ...control.platform_controller import LEGS, PlatformController
from ...engine import DelayLine
from ..guard import Guard
from ..sampled_loop import SIMULATION_FAILED
from .coupling import Coupling
from .legs import Inputs, Instants, LegSensors
from .setup import PlatformSetup


def run_in_python(
    setup: PlatformSetup, sensors: LegSensors, controller: PlatformController, inputs: Inputs
) -> Instants:
    """The loop of a controller along its inputs, from the setup's operating point."""
    loop = _Loop(setup, sensors, controller, inputs)
    for k in range(len(inputs.pose)):
        if not loop.step(k):
            break
    x, held, sent, demanded = (np.array(column) for column in (loop.x, loop.held, loop.sent, loop.demanded))
    return Instants(x, held, sent, demanded, loop.tripped)


class _Loop:
    """Six guards, six delays and the plant; `step` goes on by one period."""

    def __init__(
        self, setup: PlatformSetup, sensors: LegSensors, controller: PlatformController, inputs: Inputs
    ) -> None:
        self._setup, self._sensors, self._controller, self._inputs = setup, sensors, controller, inputs
        self._guards = [
            Guard(rig, controller.measures, sensors.noisy, carried)
            for rig, carried in zip(setup.guarded, setup.carried, strict=True)
        ]
        self._coupling = Coupling(setup)
        self._state, self._u = setup.null.x.copy(), setup.null.u.copy()
        plant, commands = setup.engine.plant, self._u[:LEGS].copy()
        self._line = DelayLine(plant.lateness(), setup.platform.period, commands, plant.interpolated)
        for guard, command in zip(self._guards, self._u[:LEGS], strict=True):
            guard.reset(float(command))
        measured = self._by_name(sensors.read(setup.engine.observe(self._state, self._u), inputs.normal[0]))
        controller.reset(inputs.reference[0], measured, self._u[:LEGS].copy())
        self.x: list[np.ndarray] = []
        self.held: list[np.ndarray] = []
        self.sent: list[np.ndarray] = []
        self.demanded: list[np.ndarray] = []
        self.tripped: str | None = None

    def step(self, k: int) -> bool:
        """One period; False where it cannot be simulated."""
        self._u[LEGS:] = self._inputs.others[k]
        outputs = self._setup.engine.observe(self._state, self._u)
        sent, demanded = self._sample(k, self._sensors.read(outputs, self._inputs.normal[k + 1]))
        arriving = self._line.send(sent)
        for column, values in ((self.x, self._state), (self.sent, sent), (self.demanded, demanded)):
            column.append(values)
        self.held.append(arriving[0][0])
        after = self._setup.engine.advance_arriving(self._state, self._u, arriving, self._setup.platform.period)
        if after is None:
            self.tripped = SIMULATION_FAILED
            return False
        self._state = after
        return True

    def _sample(self, k: int, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Commands sent and demanded; where one guard trips, the other legs brake, too."""
        reference, forward = self._inputs.reference[k], self._inputs.forward[k]
        measured = [dict(zip(self._sensors.names, row.tolist(), strict=True)) for row in readings]
        coupled = self._coupling.of(self._guards, measured)
        for guard, signals, setpoint, own in zip(self._guards, measured, reference, coupled, strict=True):
            guard.watch(signals, float(setpoint), own)
        stopped = any(guard.tripped for guard in self._guards)
        demanded = np.zeros(LEGS)
        if not stopped:
            demanded = self._controller.compute(reference, self._by_name(readings), forward)
        if stopped:
            first = next(i for i, guard in enumerate(self._guards) if guard.tripped)
            self.tripped = self.tripped or f"leg {first + 1}: {self._guards[first].tripped}"
            for guard in self._guards:
                guard.stop_beside()
        sent = np.array([guard.limit(float(u)) for guard, u in zip(self._guards, demanded, strict=True)])
        if not stopped:
            self._controller.update(sent)
        return sent, demanded

    def _by_name(self, readings: np.ndarray) -> dict[str, np.ndarray]:
        return dict(zip(self._sensors.names, readings.T, strict=True))
