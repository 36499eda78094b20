"""A linear plant of the user's own as its designs see it: its matrices and a Kalman filter on the position alone; its
response, and what a law in the frequency domain may cancel.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.errors import InputError
from ..linear.sampling import hold_matrices, zero_order_hold
from ..linear.state_space import StateSpace, modal_form
from ..rigs.linear_rig import LinearRig
from .kalman_observer import Observer, StateLaw, kalman_gain
from .protocol import design_numbers, number

_QUIET = 1e-6  # of the stroke: the noise that is taken where a sensor has none
_NULL = 1e-6  # rad/s over the largest pole: a root so slow counts as 0
_FAST = 0.25  # of the sampling frequency: faster roots stay in the plant
_SHARP = 0.2  # damping below which a zero stays in the plant: its cancellation would ring


def sampled_model(plant: LinearRig, period: float) -> StateSpace:
    """command -> position [m], held over each `period` [s], with the plant's delay and the computing delay.

    States are the plant's over their sizes, then the commands on their way.
    """
    a, b, c, _ = plant.state_matrices()
    size = np.array(plant.sizes)
    scaled = a * size / size[:, None], b / size[:, None], c[:1] * size, np.zeros((1, 1))
    late = plant.delay.value + plant.computing_delay.value
    return StateSpace(*zero_order_hold(scaled, late, period), period, ["command"], ["position"])


@design_numbers
class ObservedPlant:
    """How far the sensor and the model are trusted, and where what is unknown acts."""

    position_noise: float = number("m", 0.0, 1.0, "standard deviation of a position sample; 0: the sensor's own", 0.0)
    disturbance: float = number(
        "1", 0.0, 99.0, "where a disturbance acts: 0 on the command, k on the rate of the plant's state k", 0.0
    )
    command_noise: float = number("1", 1e-6, 1.0, "standard deviation of what the model misses, as a command", 0.1)
    disturbance_walk: float = number("1/s^0.5", 1e-9, 1e6, "how the disturbance walks: its deviation after 1 s", 1e-2)


class LinearObserver(Observer):
    """A steady Kalman filter on the position: x[k+1] = A x[k] + B u[k] + F d[k], d a random walk, y = C x.

    F is B where the disturbance acts on the command; else it is what a state's rate, in that state's size per second,
    makes of all states in a period. Its state is x, as `sampled_model` has it, then d. `steady` [n + 1, 2] has what
    the reference and d ask for at rest: the states, then the command. Raises InputError where the position does not
    show such a disturbance, or no command holds the position against it.
    """

    def __init__(self, plant: LinearRig, trust: ObservedPlant, period: float) -> None:
        model = sampled_model(plant, period)
        self.a, self.b, c = model.matrices[:3]
        self.n = n = len(self.a)
        self.measures, self.pick = ("position",), np.eye(1)
        acting = self._acting(plant, round(trust.disturbance), period)
        self.ahead = np.block([[self.a, acting[:, None]], [np.zeros((1, n)), np.eye(1)]])
        self.entering = np.append(self.b, 0.0)
        row = np.append(c[0], 0.0)
        self.output_matrix = row[None]
        self.signals = {"position": row, "speed": row @ (self.ahead - np.eye(n + 1)) / period}
        drives = np.column_stack((self.entering, np.eye(n + 1)[:, n]))
        drives *= trust.command_noise, trust.disturbance_walk * np.sqrt(period)
        noise = trust.position_noise or _sensor_noise(plant)
        held = np.block([[self.a - np.eye(n), self.b], [c, np.zeros((1, 1))]])
        asked = np.column_stack((np.eye(n + 1)[:, n], np.append(-acting, 0.0)))
        pushed = np.block([[self.a - np.eye(n), acting[:, None]], [c, np.zeros((1, 1))]])
        try:
            self.gain = kalman_gain(self.ahead, drives @ drives.T, self.output_matrix, np.array([noise]))
            self.steady = np.linalg.solve(held, asked)
            self._at_rest = np.linalg.solve(pushed, np.column_stack((np.append(-self.b, 0.0), np.eye(n + 1)[:, n])))
        except np.linalg.LinAlgError:
            what = f"the position of {plant.name} does not tell a disturbance there from its states"
            raise InputError(f"disturbance: {what}; let it act elsewhere") from None

    def _acting(self, plant: LinearRig, place: int, period: float) -> np.ndarray:
        """F [n]."""
        if not place:
            return self.b[:, 0]
        a, size = plant.state_matrices()[0], np.array(plant.sizes)
        if place > len(size):
            raise InputError(f"disturbance: {plant.name} has {len(size)} states, no state {place}; ask for less")
        rates = np.eye(len(size))[:, [place - 1]]
        _, moved = hold_matrices(a * size / size[:, None], rates, period)
        return np.append(moved[:, 0], np.zeros(self.n - len(size)))

    def state_law(self, feedback: np.ndarray) -> StateLaw:
        """The law u = u0 - K (x^ - x0), x0 and u0 at rest at the reference under d, of a feedback K [n]."""
        (reference, disturbance), (command, against) = self.steady[:-1].T, self.steady[-1]
        follow = float(command + feedback @ reference)
        return StateLaw(np.append(feedback, -(against + feedback @ disturbance)), follow)

    def beginning(
        self,
        measurement: Mapping[str, float] | Mapping[str, np.ndarray],
        reference: np.ndarray,
        command: np.ndarray,
        law: StateLaw,
    ) -> np.ndarray:
        """The state of a plant that rests, under the disturbance with which it needs the command that it has."""
        position = np.asarray(measurement["position"])
        holding = command - law.follow * (reference - position)
        return np.multiply.outer(self._at_rest[:, 0], holding) + np.multiply.outer(self._at_rest[:, 1], position)


def _sensor_noise(plant: LinearRig) -> float:
    """Standard deviation [m] of what the position's sensor adds, its resolution counted as even noise."""
    sensor = plant.sensors["position"]
    noise = float(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12)))
    return noise or _QUIET * plant.limit("stroke")


@dataclass(frozen=True, eq=False)
class LinearModel:
    """A linear plant sampled every `period` [s] with its delay and the computing delay."""

    plant: LinearRig
    period: float

    def response(self, f: np.ndarray) -> np.ndarray:
        """position/command at f [k] in Hz, complex [k] in m."""
        form = modal_form(self._sampled)
        return form.outputs(form.states(np.exp(2j * np.pi * np.asarray(f) * self.period)))[0, 0]

    def discretise(self, period: float) -> StateSpace:
        """command -> position [m], held over each `period` [s]."""
        return sampled_model(self.plant, period)

    @property
    def modes(self) -> np.ndarray:
        """Poles [rad/s] that a law may cancel: stable, not 0, slow enough to be sampled."""
        return self._slow(self._poles[np.abs(self._poles) > self._null])

    @property
    def zeros(self) -> np.ndarray:
        """Zeros [rad/s] that a law may cancel: stable and damped, too."""
        zeros = self._zeros
        if np.any(np.abs(zeros) < self._null):
            raise InputError(f"{self.plant.name} does not answer to a lasting command; this law needs one that does")
        return self._slow(zeros[-np.real(zeros) > _SHARP * np.abs(zeros)])

    @property
    def integrators(self) -> int:
        """How many poles are 0."""
        return int(np.sum(np.abs(self._poles) <= self._null))

    @cached_property
    def _sampled(self) -> StateSpace:
        return self.discretise(self.period)

    @cached_property
    def _poles(self) -> np.ndarray:
        return np.linalg.eigvals(self.plant.state_matrices()[0]).astype(complex)

    @cached_property
    def _zeros(self) -> np.ndarray:
        """The finite ones, by the pencil of Rosenbrock's system matrix."""
        from scipy.linalg import eigvals

        a, b, c, _ = self.plant.state_matrices()
        size = np.array(self.plant.sizes)
        system = np.block([[a * size / size[:, None], b / size[:, None]], [c[:1] * size, np.zeros((1, 1))]])
        passing = np.diag(np.append(np.ones(len(a)), 0.0))
        zeros = np.asarray(eigvals(system, passing), complex)
        return zeros[np.isfinite(zeros)]

    @property
    def _null(self) -> float:
        return _NULL * max(1.0, float(np.abs(self._poles).max(initial=0.0)))

    def _slow(self, roots: np.ndarray) -> np.ndarray:
        return roots[(np.real(roots) < 0) & (np.abs(roots) < 2 * np.pi * _FAST / self.period)]
