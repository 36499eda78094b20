"""Fractional PID: integral and derivative of any order up to two, anti-windup on the realised command."""

from collections.abc import Mapping
from functools import lru_cache
from typing import ClassVar

import numpy as np

from workbench.control.crone.oustaloup import power
from workbench.control.fractional.realisation import partial_fractions
from workbench.control.linear_law import LinearLaw
from workbench.control.protocol import design_numbers, number
from workbench.linear.state_space import Matrices, StateSpace, of_sum, state_space, tustin


class FractionalPid:
    """U(s) = K (1 + 1/(Ti s)^lambda + (Td s)^mu/(1 + s/wf)) E(s), sampled by Tustin's rule.

    PI^lambda D^mu of Podlubny, IEEE Trans. Automatic Control 44(1), 1999. The integral is 1/s after s^(1 - lambda), the
    derivative s after s^(mu - 1), with Oustaloup's cells for both powers between `low` and `high`; orders of 1 have no
    cells. Anti-windup: the integral and its cells take in E + (realised - demanded)/K, the conditioning technique of
    Hanus, Kinnaert, Henrotte, Automatica 23(6), 1987; for lambda = 1 it is back calculation over Ti.
    """

    measures: ClassVar[tuple[str, ...]] = ("position",)

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/m", 1e-3, 100.0, "proportional gain K")
        integral_time: float = number("s", 1e-3, 1e6, "integral time Ti")
        integral_order: float = number("1", 0.1, 1.9, "lambda, the order of the integral", 1.0)
        derivative_time: float = number("s", 0.0, 10.0, "derivative time Td", 0.0)
        derivative_order: float = number("1", 0.1, 1.9, "mu, the order of the derivative", 1.0)
        low_pass: float = number("Hz", 1.0, 1e3, "wf, the corner of the derivative's low-pass", 150.0)
        low: float = number("Hz", 1e-4, 10.0, "from here on the orders hold", 0.05)
        high: float = number("Hz", 10.0, 1e3, "up to here the orders hold", 50.0)

    def __init__(self, design: Design, period: float) -> None:
        self._period = period
        self._a, self._b, self._c, self._d, self._follow = _designed(design, period)
        self._integrator = int(np.flatnonzero(self._follow)[-1])
        self._x, self._error = np.zeros(len(self._a)), 0.0

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the cells rest at this error and the integrator carries the command."""
        self._error = reference - measurement["position"]
        self._x = self._resting(self._error, command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The sum of the three terms on the error."""
        self._error = reference - measurement["position"]
        return self._demanded()

    def update(self, realised: float) -> None:
        """Advance the states; the integral takes up what the drive did not do."""
        missed = realised - self._demanded()
        self._x = self._a @ self._x + self._b * self._error + self._follow * missed

    def linear_law(self) -> LinearLaw:
        """The law as data, of reference less position."""
        both = np.array([1.0, -1.0])
        a = self._a - np.outer(self._follow, self._c)
        b = self._b - self._follow * self._d

        def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
            return self._resting(float(signals[0] - signals[1]), command), 0.0

        return LinearLaw(a, np.outer(b, both), self._c, self._d * both, self._follow, self.measures, start)

    def linear(self) -> StateSpace:
        """The same law without the command limit."""
        law = state_space(self._a, self._b[:, None], self._c[None], [[self._d]], self._period, ["error"], ["command"])
        return of_sum(law, {"reference": 1.0, "position": -1.0})

    def _demanded(self) -> float:
        return float(self._c @ self._x + self._d * self._error)

    def _resting(self, error: float, command: float) -> np.ndarray:
        """States [n] that stay under this error, but for the integrator, which makes up the command."""
        cells = np.arange(len(self._a)) != self._integrator
        x = np.zeros(len(self._a))
        x[cells] = np.linalg.solve(np.eye(cells.sum()) - self._a[np.ix_(cells, cells)], self._b[cells] * error)
        x[self._integrator] = command - self._c @ x - self._d * error
        return x


@lru_cache(maxsize=16)
def _designed(
    design: FractionalPid.Design, period: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, np.ndarray]:
    """a [n, n], b [n], c [n], d from error to command, and what the integral takes up of a missed command [n].

    States: the integral's cells, the integrator, the derivative's filter and cells.
    """
    d = design
    before = tustin(_cells(1 - d.integral_order, d), period)
    slope = tustin(_after(_low_passed(2 * np.pi * d.low_pass), _cells(d.derivative_order - 1, d)), period)
    half = d.gain * d.integral_time**-d.integral_order * period / 2
    rate = d.gain * d.derivative_time**d.derivative_order
    n, m = len(before[0]), len(slope[0])
    a, b = np.zeros((n + 1 + m, n + 1 + m)), np.zeros(n + 1 + m)
    a[:n, :n], a[n, :n], a[n, n], a[n + 1 :, n + 1 :] = before[0], 2 * half * before[2][0], 1.0, slope[0]
    b[:n], b[n], b[n + 1 :] = before[1][:, 0], 2 * half * before[3][0, 0], slope[1][:, 0]
    c = np.concatenate((half * before[2][0], [1.0], rate * slope[2][0]))
    direct = d.gain + half * before[3][0, 0] + rate * slope[3][0, 0]
    follow = np.append(b[: n + 1], np.zeros(m)) / (d.gain + half * before[3][0, 0])
    return a, b, c, float(direct), follow


def _cells(order: float, d: FractionalPid.Design) -> Matrices:
    """s^order over the band of the design; 1, without states, for order 0."""
    a, b, c, direct = (
        partial_fractions(power(order, d.low, d.high)) if order else (np.zeros((0, 0)), *np.zeros((2, 0)), 1.0)
    )
    return a, b[:, None], c[None], np.array([[direct]])


def _low_passed(corner: float) -> Matrices:
    """s/(1 + s/corner), the corner in rad/s."""
    one = np.eye(1)
    return -corner * one, corner * one, -corner * one, corner * one


def _after(first: Matrices, second: Matrices) -> Matrices:
    """Both in series. States: the first's, then the second's."""
    (a, b, c, d), (e, f, g, h) = first, second
    return np.block([[a, np.zeros((len(a), len(e)))], [f @ c, e]]), np.vstack((b, f @ d)), np.hstack((h @ c, g)), h @ d
