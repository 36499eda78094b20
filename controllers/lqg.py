"""LQG: the best that a linear controller makes of position and pressures, by its own measure: a yardstick."""

from collections.abc import Mapping
from dataclasses import dataclass

import control
import numpy as np

from workbench.controller import number
from workbench.fractional import JackModel


class Lqg:
    """u = K (r, 0, ...) - K x^ - d^: state feedback on what a Kalman filter sees in position and pa - pb.

    K minimises the sum of (e/error)^2 + u^2. The filter knows the jack's model, the noise of its sensors, and two
    random walks, a command that the drive adds (d) and a pressure that carries a load, so that neither leaves an offset
    (Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 9). It runs on the command that
    the drive really got. The model is that of the jack alone: here nothing else damps it.
    """

    measures = ("position", "pa", "pb")

    @dataclass(frozen=True)
    class Design(JackModel):
        """Design numbers: the jack's model, what an error costs, and how far signals and model are trusted."""

        inertia: float = number("Pa s^2/m", 1.0, 1e9, "pressure per acceleration: mass over area", 2e5)
        error: float = number("m", 1e-6, 10.0, "the position error that costs as much as full command", 0.1)
        position_noise: float = number("m", 1e-9, 1e-2, "standard deviation of a position sample", 4e-5)
        pressure_noise: float = number("Pa", 1.0, 1e7, "standard deviation of a sample of pa - pb", 2e4)
        command_noise: float = number("1", 1e-6, 1.0, "standard deviation of what the model misses, as a command", 0.1)
        command_walk: float = number("1/s^0.5", 1e-9, 10.0, "how d walks: its standard deviation after 1 s", 1e-2)
        pressure_walk: float = number("Pa/s^0.5", 1e-3, 1e9, "how the pressure of a load walks", 1e6)

    def __init__(self, design: Design, period: float) -> None:
        d, self._period = design, period
        jack = design.sampled(period)
        a, b, c = (np.asarray(part) for part in (jack.A, jack.B, jack.C))
        n = len(a)
        feedback = np.asarray(control.dlqr(a, b, np.outer(c[0], c[0]) / d.error**2, np.eye(1))[0])
        self._a = np.block([[a, b, np.zeros((n, 1))], [np.zeros((2, n)), np.eye(2)]])
        self._b = np.vstack((b, np.zeros((2, 1))))[:, 0]
        self._c = np.block([[c[:1], np.zeros((1, 2))], [d.inertia * c[1:], np.array([[0.0, 1.0]])]])
        drives = np.column_stack((self._b, np.eye(n + 2)[:, n:]))
        drives *= d.command_noise, d.command_walk * np.sqrt(period), d.pressure_walk * np.sqrt(period)
        trust = np.array([d.position_noise, d.pressure_noise])
        seen = self._c / trust[:, None]  # each sensor in its own noise, or the Riccati equation is ill conditioned
        noise = drives @ drives.T
        spread = np.asarray(control.dlqe(self._a, np.eye(n + 2), seen, (noise + noise.T) / 2, np.eye(2))[1])
        self._gain = np.linalg.solve(seen @ spread @ seen.T + np.eye(2), seen @ spread).T / trust
        self._feedback, self._position = np.append(feedback[0], [1.0, 0.0]), c[0]
        self._follow = float(feedback[0] @ self._position)
        self._x, self._seen = np.zeros(n + 2), np.zeros(2)

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the filter sees a jack at rest, whose drive needs the command that it holds."""
        position, pressure = self._seen = _signals(measurement)
        offset = self._follow * (reference - position) - command
        self._x = np.concatenate((self._position * position, [offset, pressure]))

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """State feedback on what the filter makes of these signals."""
        self._seen = _signals(measurement)
        return float(self._follow * reference - self._feedback @ self._corrected())

    def update(self, realised: float) -> None:
        """Predict the next period with the command that the drive really got."""
        self._x = self._a @ self._corrected() + self._b * realised

    def _corrected(self) -> np.ndarray:
        return self._x + self._gain @ (self._seen - self._c @ self._x)

    def linear(self) -> control.StateSpace:
        """Filter and feedback together."""
        pick = np.array([[0.0, 1, 0, 0], [0, 0, 1, -1]])  # position and pa - pb out of reference, position, pa, pb
        corrected, seen = np.eye(len(self._a)) - self._gain @ self._c, self._gain @ pick
        leaving = -self._feedback[None] @ corrected
        direct = -self._feedback[None] @ seen + self._follow * np.eye(1, 4)
        ahead, entering = self._a @ corrected + np.outer(self._b, leaving), self._a @ seen + np.outer(self._b, direct)
        names = {"inputs": ["reference", *self.measures], "outputs": ["command"]}
        return control.StateSpace(ahead, entering, leaving, direct, self._period, **names)


def _signals(measurement: Mapping[str, float]) -> np.ndarray:
    """Position [m] and pressure difference [Pa]."""
    return np.array([measurement["position"], measurement["pa"] - measurement["pb"]])
