"""What a model-based controller knows of a jack: its model and a Kalman filter of its state, load and drive offset."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..engine import lazy_casadi as ca
from .jack_model import JackModel
from .law import Law, linear_law
from .protocol import design_numbers, number


@design_numbers
class ObservedJack(JackModel):
    """The jack's model, and how far signals and model are trusted. Without a `spool_travel` no spool is measured."""

    inertia: float = number("Pa s^2/m", 1.0, 1e9, "pressure per acceleration: mass over area", 2e5)
    spool_travel: float = number("m", 0.0, 0.1, "spool travel at full command; 0: no spool sensor", 0.0)
    position_noise: float = number("m", 1e-9, 1e-2, "standard deviation of a position sample", 4e-5)
    pressure_noise: float = number("Pa", 1.0, 1e7, "standard deviation of a sample of pa - pb", 2e4)
    spool_noise: float = number("m", 1e-9, 1e-2, "standard deviation of a spool sample", 1e-5)
    command_noise: float = number("1", 1e-6, 1.0, "standard deviation of what the model misses, as a command", 0.1)
    command_walk: float = number("1/s^0.5", 1e-9, 10.0, "how d walks: its standard deviation after 1 s", 1e-2)
    pressure_walk: float = number("Pa/s^0.5", 1e-3, 1e9, "how the pressure of a load walks", 1e6)


@dataclass(frozen=True)
class StateLaw:
    """u = follow r - feedback x^ of an observed state [k]."""

    feedback: np.ndarray
    follow: float


class Observer(ABC):
    """A steady Kalman filter of a plant and of what disturbs it, on the command that the drive really got.

    The state [k] is the plant's [n], then the disturbances. `a` and `b` are the plant's own, `ahead`, `entering` and
    `output_matrix` those of the whole state, `pick` makes the filter's signals of those that are `measures`; `signals`
    gives quantities, the "position" among them, as rows on the state.
    """

    a: np.ndarray
    b: np.ndarray
    n: int
    measures: tuple[str, ...]
    ahead: np.ndarray
    entering: np.ndarray
    output_matrix: np.ndarray
    pick: np.ndarray
    gain: np.ndarray
    signals: dict[str, np.ndarray]

    @abstractmethod
    def beginning(
        self,
        measurement: Mapping[str, float] | Mapping[str, np.ndarray],
        reference: np.ndarray,
        command: np.ndarray,
        law: StateLaw,
    ) -> np.ndarray:
        """That state [k]; [k, lanes] of signals, references and commands [lanes]."""

    def starting(self, law: StateLaw) -> np.ndarray:
        """`beginning` as a matrix [k, m + 2] on what is measured, the reference and the command."""
        *signals, reference, command = np.eye(len(self.measures) + 2)
        return self.beginning(dict(zip(self.measures, signals, strict=True)), reference, command, law)

    def law(self, law: StateLaw, period: float) -> Law:
        """Filter and feedback as a law; the filter runs on the realised command."""
        feedback, follow, starting = law.feedback, law.follow, self.starting(law)
        corrected = np.eye(len(self.ahead)) - self.gain @ self.output_matrix
        signals = self.gain @ self.pick
        c, d = -feedback @ corrected, np.append(follow, -feedback @ signals)
        a, b = self.ahead @ corrected, np.hstack((np.zeros((len(corrected), 1)), self.ahead @ signals))

        def start(s: "ca.SX", u: "ca.SX") -> tuple["ca.SX", float]:
            return ca.DM(starting) @ ca.vertcat(s[1:], s[0], u), 0.0

        return linear_law(a, b, c, d, self.entering, self.measures, period, start)


class JackObserver(Observer):
    """A steady Kalman filter: x[k+1] = A x[k] + B (u[k] + d), with two random walks, so that nothing is left over.

    They are d, a command that the drive adds, and a pressure that carries a load (Franklin, Powell, Workman, Digital
    Control of Dynamic Systems, 3rd ed. 1998, ch. 9). Its state [n + 2] is the jack's, as JackModel.sampled has it, then
    d [1] and the load's pressure [Pa]. `signals` gives position [m], speed [m/s] and pa - pb [Pa] as rows on it. It
    runs on the command that the drive really got.
    """

    def __init__(self, jack: ObservedJack, period: float) -> None:
        j, model = jack, jack.discretise(period)
        self.a, self.b, c = model.matrices[:3]
        self.n = n = len(self.a)
        self.measures = ("position", "pa", "pb", *(("spool",) if j.spool_travel else ()))
        self.ahead = np.block([[self.a, self.b, np.zeros((n, 1))], [np.zeros((2, n)), np.eye(2)]])
        self.entering = np.vstack((self.b, np.zeros((2, 1))))[:, 0]
        rows = [np.append(c[0], [0.0, 0.0]), np.append(j.inertia * c[1], [0.0, 1.0])]
        trust, self.pick = [j.position_noise, j.pressure_noise], np.array([[1.0, 0, 0], [0, 1, -1]])
        if j.spool_travel:
            rows.append(j.spool_travel * np.eye(1, n + 2, 3)[0])
            trust.append(j.spool_noise)
            self.pick = np.array([[1.0, 0, 0, 0], [0, 1, -1, 0], [0, 0, 0, 1]])
        self.output_matrix = np.array(rows)
        w = 2 * np.pi * j.jack_frequency
        self.signals = {"position": rows[0], "speed": w * np.eye(1, n + 2, 1)[0], "pressure": rows[1]}
        drives = np.column_stack((self.entering, np.eye(n + 2)[:, n:]))
        drives *= j.command_noise, j.command_walk * np.sqrt(period), j.pressure_walk * np.sqrt(period)
        self.gain = kalman_gain(self.ahead, drives @ drives.T, self.output_matrix, np.array(trust))

    def beginning(
        self,
        measurement: Mapping[str, float] | Mapping[str, np.ndarray],
        reference: np.ndarray,
        command: np.ndarray,
        law: StateLaw,
    ) -> np.ndarray:
        """The state of a jack at rest, whose drive needs the command that it holds."""
        return self.resting(measurement, law.follow * (reference - measurement["position"]) - command)

    def resting(
        self, measurement: Mapping[str, float] | Mapping[str, np.ndarray], offset: float | np.ndarray
    ) -> np.ndarray:
        """The state [n + 2] of a jack at rest at these signals, to whose command the drive adds `offset` [1]; [n + 2,
        lanes] of signals and offsets [lanes]."""
        position, pressure = (self.pick @ [measurement[name] for name in self.measures])[:2]
        jack = np.multiply.outer(self.signals["position"][: self.n], position)
        return np.concatenate((jack, [offset, pressure]))


def kalman_gain(a: np.ndarray, noise: np.ndarray, c: np.ndarray, trust: np.ndarray) -> np.ndarray:
    """Gain of the correction. Each sensor in its own noise, or the Riccati equation is ill conditioned."""
    from scipy.linalg import solve_discrete_are

    scaled = c / trust[:, None]
    k = len(trust)
    spread = solve_discrete_are(a.T, scaled.T, (noise + noise.T) / 2, np.eye(k))
    return np.linalg.solve(scaled @ spread @ scaled.T + np.eye(k), scaled @ spread).T / trust
