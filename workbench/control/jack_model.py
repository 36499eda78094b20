"""The jack in six numbers, as a position controller sees it: what CRONE and LQG designs know of their plant."""

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError
from ..linear import zero_order_hold
from ..linear.state_space import StateSpace, sampled_response
from .protocol import design_numbers, number
from .second_order_sections import Factors, pair

if TYPE_CHECKING:
    import control

FIT = (0.2, 60.0)  # Hz: a fit sees these frequencies
_POINTS = 100
_SEARCHED = ("velocity_gain", "jack_frequency", "valve_frequency", "jack_damping", "valve_damping", "delay")
_LEAST = 1e-9  # of a number that may be 0 and is searched by its logarithm
_START = (30.0, 100.0, 0.5, 0.5, 1e-3)  # of a search: the two modes [Hz], their damping, the delay [s]


@design_numbers
class JackModel:
    """position/command = velocity_gain exp(-s delay) / (s (jack mode) (valve mode)), each mode of gain 1 at s = 0.

    Fitted with a pressure feedback closed, it is the model of the plant so damped.
    """

    velocity_gain: float = number("m/s", 1e-3, 1e3, "speed per unit of command")
    jack_frequency: float = number("Hz", 0.1, 1e3, "natural frequency of the mass on the oil")
    jack_damping: float = number("1", 1e-3, 10.0, "damping of the mass on the oil")
    valve_frequency: float = number("Hz", 0.1, 1e3, "natural frequency of the valve")
    valve_damping: float = number("1", 1e-3, 10.0, "damping of the valve")
    delay: float = number("s", 0.0, 0.1, "what the modes leave of the phase: half a period, faster dynamics")

    @property
    def modes(self) -> np.ndarray:
        """The four poles [rad/s] of jack and valve."""
        return _modes(self.jack_frequency, self.jack_damping, self.valve_frequency, self.valve_damping)

    @property
    def zeros(self) -> np.ndarray:
        """None."""
        return np.zeros(0)

    @property
    def integrators(self) -> int:
        """The position's."""
        return 1

    def response(self, f: np.ndarray) -> np.ndarray:
        """position/command at f [k] in Hz, complex [k] in m."""
        return _response(f, self.velocity_gain, self.delay, self.modes)

    def discretise(self, period: float) -> StateSpace:
        """command -> position [m] and acceleration, held over each `period` [s]; half a period of delay is the hold's.

        States: position, speed/w, acceleration/w^2 of the jack's mode, what the valve gives (as a command), its rate/w
        of the valve's mode, then the commands on their way.
        """
        w, wv = 2 * np.pi * self.jack_frequency, 2 * np.pi * self.valve_frequency
        a = np.zeros((5, 5))
        a[0, 1] = a[1, 2] = w
        a[2, 1:4] = -w, -2 * self.jack_damping * w, self.velocity_gain
        a[3:, 3:] = [[0, wv], [-wv, -2 * self.valve_damping * wv]]
        outputs = np.array([[1, 0, 0, 0, 0], [0, 0, w**2, 0, 0]])
        late = max(0.0, self.delay - period / 2)
        matrices = zero_order_hold((a, wv * np.eye(5, 1, -4), outputs, np.zeros((2, 1))), late, period)
        return StateSpace(*matrices, period, ["command"], ["position", "acceleration"])


def fit_jack_model(plant: "StateSpace | control.StateSpace") -> JackModel:
    """The numbers of a sampled plant (command -> position, such as `linear.discretise` gives).

    Least squares of the logarithm of the response (decibels and degrees alike) over FIT. Raises InputError where the
    model stays more than 1 dB off, such as for a plant that does not integrate.
    """
    from scipy.optimize import least_squares

    f = np.geomspace(*FIT, _POINTS)
    period = float(plant.dt or 0.0)
    f = f[f < 0.4 / period]
    response = sampled_response(plant, np.exp(2j * np.pi * f * period))[0, 0]

    def off(x: np.ndarray) -> np.ndarray:
        gain, jack, valve, jack_damping, valve_damping, delay = np.exp(x)
        ratio = _response(f, gain, delay, _modes(jack, jack_damping, valve, valve_damping)) / response
        return np.append(np.log(np.abs(ratio)), np.angle(ratio))

    start = np.log((float(np.abs(response[0]) * 2 * np.pi * f[0]), *_START))
    fit = least_squares(off, start, x_scale=0.1)
    bounds = {n.name: (max(n.metadata["low"], _LEAST), n.metadata["high"]) for n in fields(JackModel)}
    low, high = np.log([bounds[name] for name in _SEARCHED]).T
    if not np.array_equal(fit.x, np.clip(fit.x, low, high)):  # a mode far above FIT, which does not tell where
        fit = least_squares(off, np.clip(fit.x, low, high), x_scale=0.1, bounds=(low, high))
    worst = 20 / np.log(10) * float(np.abs(fit.fun[: len(f)]).max())
    if not worst < 1.0:
        raise InputError(f"the jack: an integrator with two modes is {worst:.1f} dB off; damp the jack first")
    return JackModel(**dict(zip(_SEARCHED, np.exp(fit.x).tolist(), strict=True)))


def _modes(jack: float, jack_damping: float, valve: float, valve_damping: float) -> np.ndarray:
    """The poles [4] in rad/s of two modes with natural frequencies in Hz."""
    return np.append(pair(jack, jack_damping), pair(valve, valve_damping))


def _response(f: np.ndarray, gain: float, delay: float, modes: np.ndarray) -> np.ndarray:
    s = 2j * np.pi * np.asarray(f)
    return gain * np.exp(-s * delay) / s * Factors(np.array([]), modes)(f)


@design_numbers
class NominalJack:
    """The jack about which the meter measures."""

    inertia: float = number("Pa s^2/m", 1.0, 1e9, "nominal mass over area")
    jack_frequency: float = number("Hz", 0.1, 1e3, "nominal natural frequency at mid stroke")
    velocity_gain: float = number("m/s", 1e-3, 1e3, "nominal velocity per command")
    valve_frequency: float = number("Hz", 1.0, 1e4, "natural frequency of the valve")
    valve_damping: float = number("1", 0.1, 10.0, "damping of the valve")
    reach: float = number("m", 1e-3, 100.0, "half the length of both oil columns, dead volumes included")
