"""What a linear loop costs and bears: its dynamic stiffness, and the noise that its sensors put on the command."""

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..control.protocol import linear_view
from ..linear.linearisation import linear_plant
from ..linear.sampling import sampled_plant
from ..linear.state_space import sampled_response
from .margins import LinearLoop
from .rows import LoopSetup


def dynamic_stiffness(spec: ControllerSpec, setup: LoopSetup, f: np.ndarray) -> np.ndarray:
    """Disturbance force over the position that gives way to it [N/m], complex [k], at f [k] in Hz, at null.

    Of a stable linear loop, exact at the sampling instants: the plant answers the sine as it is, the controller in
    samples. Raises NoLinearView for a controller without a linear view.
    """
    period, plant = setup.rig.period.value, setup.engine.plant
    controller = spec.build(period)
    names = tuple(dict.fromkeys((*controller.measures, "position")))
    z, count, i = np.exp(2j * np.pi * f * period), len(controller.measures), names.index("position")
    commanded = sampled_response(sampled_plant(plant, setup.null_smooth, period, names, setup.smooth), z)[:, 0]
    pushed = linear_plant(plant, setup.null_smooth, ("disturbance",), names, setup.smooth)
    disturbed = pushed(2j * np.pi * f, squeeze=False)[:, 0]
    gains = sampled_response(linear_view(controller, setup.null_plant.point), z)[0, 1:]
    command = np.sum(gains * disturbed[:count], axis=0) / (1 - np.sum(gains * commanded[:count], axis=0))
    return -1 / (disturbed[i] + commanded[i] * command)  # a disturbance acts against positive motion


def command_noise(spec: ControllerSpec, setup: LoopSetup, loop: LinearLoop) -> float | None:
    """RMS of the command [1] at rest, from declared sensor noise and resolution; None for an unstable loop
    and for a controller without a linear view.

    White noise of a sample's variance over the band to the Nyquist frequency; a resolution q counts as q^2/12.
    """
    if loop.sensitivity is None or loop.margins != "linear":
        return None
    period = setup.rig.period.value
    controller = spec.build(period)
    law = linear_view(controller, setup.null_plant.point)
    gains = sampled_response(law, np.exp(2j * np.pi * loop.f * period))[0, 1:]
    sensors = [setup.rig.sensors[name] for name in controller.measures]
    variance = np.array([sensor.noise**2 + sensor.resolution**2 / 12 for sensor in sensors])
    density = 2 * period * variance @ np.abs(gains * loop.sensitivity) ** 2
    return float(np.sqrt(np.trapezoid(density, loop.f)))
