"""Closed loops of a platform: six sampled laws, a guard on each jack, and the plant; compiled where the laws are."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...control.platform_controller import LEGS, PlatformController
from ...control.platform_law import platform_law
from ...rigs.platform import AXES
from .compiled import run_compiled
from .legs import Inputs, Instants, LegSensors
from .python import run_in_python
from .setup import PlatformSetup


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


def _result(setup: PlatformSetup, inputs: Inputs, done: Instants) -> PlatformRun:
    plant, k = setup.engine.plant, len(done.x)
    outputs = setup.engine.outputs(done.x, np.hstack((done.held, inputs.others[:k])))
    signals = {name: outputs[:, i] for i, name in enumerate(plant.outputs)}
    pose = np.column_stack([signals[axis] for axis in AXES])
    t = np.arange(k) * setup.platform.period
    return PlatformRun(t, inputs.pose[:k], pose, signals, done.sent, done.demanded, done.tripped)
