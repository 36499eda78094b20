"""Closed loops of a platform: six sampled laws, a guard on each jack, and the plant; compiled where the laws are.

Those in Python are what laws without a graph run in, and the oracle of the compiled ones: their guards are those of the
compiled loop, evaluated sample by sample.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...control.platform_controller import LEGS, PlatformController
from ...control.platform_law import direct_law, platform_law
from ...engine import DelayLine
from ...engine.buffered import BufferedFunction
from ...engine.guard_shape import length
from ...engine.instant import controller_instant
from ...rigs.platform import AXES
from ..sampled_loop import SIMULATION_FAILED
from .compiled import CompiledPlatform, Inputs, LegSensors, PlatformSamples, run_compiled
from .setup import PlatformSetup


def run_in_python(
    setup: PlatformSetup, sensors: LegSensors, controller: PlatformController, inputs: Inputs
) -> PlatformSamples:
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
    return PlatformSamples(states, held, every, asked, reason or guards.reason)


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


@dataclass(frozen=True)
class PlatformRun:
    """What a loop did at times t [k]: the pose asked for and the true one [k, 6], every output of the plant by name
    [k], commands `sent` and `demanded` [k, 6]; `tripped` says which leg's guard stopped it and why, or that the
    simulation failed."""

    t: np.ndarray
    reference: np.ndarray
    pose: np.ndarray
    signals: Mapping[str, np.ndarray]
    sent: np.ndarray
    demanded: np.ndarray
    tripped: str | None

    def legs(self, name: str) -> np.ndarray:
        """A signal of all legs [k, 6]."""
        return np.column_stack([self.signals[f"leg{i + 1}.{name}"] for i in range(LEGS)])


def leg_references(setup: PlatformSetup, pose: np.ndarray) -> np.ndarray:
    """The positions [k, 6] that the legs' sensors say in poses [k, 6]."""
    return setup.platform.positions(pose)


def run_platform(
    setup: PlatformSetup,
    controller: PlatformController,
    pose: np.ndarray,
    seed: int | None = None,
    compiled: bool = True,
    wrench: Mapping[str, np.ndarray] | None = None,
    added: np.ndarray | None = None,
) -> PlatformRun:
    """From the setup's operating point along poses [k, 6] at the control period, smoothed and with feed-forward where
    the controller has these; `wrench` has inputs of the plant [k] by name, `added` [k, 6] goes to the commands.

    `seed` switches the sensors' noise and resolution on. `compiled=False` keeps the laws in Python. Raises InputError
    for a signal that the legs do not measure.
    """
    sensors = LegSensors.of(setup, controller.measures, seed is not None)
    inputs = inputs_of(setup, controller, pose, wrench or {}, sensors.draws(len(pose), seed))
    if added is not None:
        inputs = replace(inputs, forward=inputs.forward + added)
    law = platform_law(controller) if compiled and setup.engine.back_end == "compiled" else None
    if law:
        return _result(setup, inputs, run_compiled(setup, sensors, law, inputs))
    return _result(setup, inputs, run_in_python(setup, sensors, controller, inputs))


def inputs_of(
    setup: PlatformSetup,
    controller: PlatformController,
    pose: np.ndarray,
    wrench: Mapping[str, np.ndarray],
    normal: np.ndarray,
) -> Inputs:
    """What comes in along poses [k, 6], with a `wrench` by name [k] and standard normal numbers [1 + k, 6 sensors]."""
    plant, period = setup.engine.plant, setup.platform.period
    reference = leg_references(setup, controller.smoothed(pose, period))
    others = np.zeros((len(pose), len(plant.inputs) - LEGS))
    for name, values in wrench.items():
        others[:, plant.input(name) - LEGS] = values
    return Inputs(pose, reference, controller.forward_commands(reference, period), others, normal)


def _result(setup: PlatformSetup, inputs: Inputs, done: PlatformSamples) -> PlatformRun:
    plant, k = setup.engine.plant, len(done.x)
    outputs = setup.engine.outputs(done.x, np.hstack((done.held, inputs.others[:k])))
    signals = {name: outputs[:, i] for i, name in enumerate(plant.outputs)}
    pose = np.column_stack([signals[axis] for axis in AXES])
    t = np.arange(k) * setup.platform.period
    return PlatformRun(t, inputs.pose[:k], pose, signals, done.sent, done.demanded, done.tripped)
