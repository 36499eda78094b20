"""Fractional PID: integral and derivative of any order up to two, anti-windup on the realised command."""

from functools import lru_cache
from typing import ClassVar

import numpy as np

from workbench.control.crone.oustaloup import power
from workbench.control.fractional.realisation import partial_fractions
from workbench.control.law import LawController, linear_law
from workbench.control.protocol import design_numbers, number
from workbench.engine import lazy_casadi as ca
from workbench.linear.state_space import Matrices, tustin


class FractionalPid(LawController):
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
        a, b, c, d, follow = _designed(design, period)
        both, integrator = np.array([1.0, -1.0]), int(np.flatnonzero(follow)[-1])
        cells = np.arange(len(a)) != integrator
        at_rest = np.zeros(len(a))
        at_rest[cells] = np.linalg.solve(np.eye(cells.sum()) - a[np.ix_(cells, cells)], b[cells])
        carried = np.eye(len(a))[integrator]

        def start(s: "ca.SX", u: "ca.SX") -> tuple["ca.SX", float]:
            """The cells rest at this error, and the integrator carries the command."""
            error = s[0] - s[1]
            return error * at_rest + (u - (c @ at_rest + d) * error) * carried, 0.0

        less, entering = a - np.outer(follow, c), np.outer(b - follow * d, both)
        super().__init__(linear_law(less, entering, c, d * both, follow, self.measures, period, start))


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
