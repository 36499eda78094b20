"""State spaces that stand for a fractional system over a band: by Oustaloup's cells, or by least squares."""

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from ...base.errors import InputError
from ...base.gain_phase import gain_db
from ...base.rational_function import fit_rational_function
from ...linear.state_space import StateSpace, state_space
from ..crone.oustaloup import power
from ..second_order_sections import Factors

if TYPE_CHECKING:
    import control

    from ...report.figures import Figure
    from .transfer_function import FractionalTransferFunction

_POINTS = 40  # a decade of the band
_STATELESS = np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0


@dataclass(frozen=True, eq=False)
class Realisation:
    """A state space from "u" to "y", and beside it the exact response [k] of what it stands for at f [k] in Hz."""

    system: StateSpace
    f: np.ndarray
    exact: np.ndarray

    @property
    def response(self) -> np.ndarray:
        """The response of the state space at f, complex [k]."""
        return np.asarray(self.system(2j * np.pi * self.f))

    @property
    def gain_error(self) -> float:
        """Largest difference of the gains over the band [dB]."""
        return float(np.abs(gain_db(self.response / self.exact)).max())

    @property
    def phase_error(self) -> float:
        """Largest difference of the phases over the band [deg]."""
        return float(np.abs(np.degrees(np.angle(self.response / self.exact))).max())

    def to_control(self) -> "control.StateSpace":
        """The python-control system."""
        return self.system.to_control()

    def figure(self) -> "Figure":
        """Both responses, and what the state space is off by, over the band."""
        from ...report.figures import Curve, Figure, FrequencyCurve, Panel, bode

        curves = [
            FrequencyCurve("exact", self.f, self.exact),
            FrequencyCurve("state space", self.f, self.response, "dash"),
        ]
        whole, ratio = bode(f"{len(self.system.A)} states for a fractional system", curves), self.response / self.exact
        errors = [
            Panel("gain error [dB]", [Curve("gain error", self.f, gain_db(ratio))]),
            Panel("phase error [deg]", [Curve("phase error", self.f, np.degrees(np.angle(ratio)))]),
        ]
        return Figure(whole.title, whole.x_label, [*whole.panels, *errors], log_x=True)

    def __repr__(self) -> str:
        states, band = len(self.system.A), f"{self.f[0]:g} to {self.f[-1]:g} Hz"
        return f"{states} states, within {self.gain_error:.2g} dB and {self.phase_error:.2g} deg from {band}"


def oustaloup_realisation(system: "FractionalTransferFunction", low: float, high: float) -> Realisation:
    """Controllable form with s^-d between neighbouring orders, as integrators and Oustaloup's cells of a power below 1.

    s^-d = s^-m s^(m - d), m = d rounded up, so that the gain at s = 0 stays exact and no loop is algebraic. Raises
    InputError for more zeros than poles.
    """
    _check(system, low, high)
    orders = sorted({order for part in (system.numerator, system.denominator) for order, _ in part.terms}, reverse=True)
    above, below = dict(system.numerator.terms), dict(system.denominator.terms)
    blocks = [_power_block(order - lower, low, high) for order, lower in pairwise(orders)]
    ends = np.cumsum([0, *(len(a) for a, _, _ in blocks)])
    size, leading = int(ends[-1]), below[orders[0]]
    a, b = np.zeros((size, size)), np.zeros(size)
    powers = np.zeros((len(orders), size))
    for i, (own, entering, leaving) in enumerate(blocks):
        rows = slice(ends[i], ends[i + 1])
        a[rows, rows], powers[i + 1, rows] = own, leaving
        if i:
            a[rows] += np.outer(entering, powers[i])
    highest = -np.array([below.get(order, 0.0) for order in orders]) @ powers / leading
    if blocks:
        a[: ends[1]] += np.outer(blocks[0][1], highest)
        b[: ends[1]] = blocks[0][1] / leading
    direct = above.get(orders[0], 0.0)
    c = np.array([above.get(order, 0.0) for order in orders]) @ powers + direct * highest
    return _realised(state_space(a, b[:, None], c[None], [[direct / leading]], 0.0, ["u"], ["y"]), system, low, high)


def least_squares_realisation(
    system: "FractionalTransferFunction", low: float, high: float, states: int
) -> Realisation:
    """A rational function near the exact response, relative error weighed evenly over ln f, as real blocks.

    Poles of the state space are in the left half plane. Raises InputError for more zeros than poles, an unstable
    system, fewer than one state or more than half of the points.
    """
    _check(system, low, high)
    if system.stability().unstable:
        raise InputError("least squares: the system is unstable; take oustaloup")
    f = _band(low, high)
    direct = system.numerator.highest == system.denominator.highest
    if not 1 <= states <= len(f) // 2:
        raise InputError(f"{states} states: must be 1 to {len(f) // 2}, half of the points of the response")
    s, response = 2j * np.pi * f, system.response(f)
    a, b = _modal(fit_rational_function(s, response, states if direct else states - 1, states, mirrored=True).poles)
    columns = np.linalg.solve(s[:, None, None] * np.eye(len(a)) - a, b[:, None])[..., 0]
    columns = np.column_stack((columns, *([np.ones(len(s))] if direct else []))) / response[:, None]
    columns, target = np.concatenate((columns.real, columns.imag)), np.repeat([1.0, 0.0], len(s))
    size = np.linalg.norm(columns, axis=0)
    c = np.linalg.lstsq(columns / size, target)[0] / size
    d = float(c[-1]) if direct else 0.0
    return _realised(state_space(a, b[:, None], c[None, : len(a)], [[d]], 0.0, ["u"], ["y"]), system, low, high)


def _modal(poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A [n, n] of real blocks with these poles, conjugate pairs exact, and B [n]."""
    n = len(poles)
    a, b = np.zeros((n, n)), np.zeros(n)
    place = 0
    for pole in poles[np.imag(poles) >= 0]:
        if pole.imag == 0:
            a[place, place], b[place] = pole.real, 1.0
            place += 1
        else:
            a[place : place + 2, place : place + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
            b[place] = 2.0
            place += 2
    return a, b


def _check(system: "FractionalTransferFunction", low: float, high: float) -> None:
    if not 0 < low < high < np.inf:
        raise InputError(f"band {low:g} to {high:g} Hz: must rise from above 0")
    if system.delay:
        raise InputError(f"{system}: a delay has no state space; realise it without, .delayed({-system.delay:g})")
    if not system.numerator.terms or system.numerator.highest > system.denominator.highest:
        raise InputError(
            f"{system}: has no state space, as its numerator is 0 or of a higher order; divide by a power of s"
        )


def _band(low: float, high: float) -> np.ndarray:
    return np.geomspace(low, high, max(int(_POINTS * np.log10(high / low)), _POINTS))


def _realised(space: StateSpace, system: "FractionalTransferFunction", low: float, high: float) -> Realisation:
    f = _band(low, high)
    return Realisation(space, f, system.response(f))


def _power_block(order: Fraction, low: float, high: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C of s^-order, order > 0: cells, then integrators."""
    whole = ceil(order)
    fraction = float(whole - order)
    a, b, c, d = partial_fractions(power(fraction, low, high)) if fraction else _STATELESS
    n = len(a)
    block, entering = np.zeros((n + whole, n + whole)), np.append(b, np.zeros(whole))
    block[:n, :n], block[n, :n], entering[n] = a, c, d
    block[np.arange(n + 1, n + whole), np.arange(n, n + whole - 1)] = 1.0
    return block, entering, np.eye(n + whole)[-1]


def partial_fractions(factors: Factors) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """A [n, n] diagonal, b [n], c [n], d of factors with as many zeros as poles, all real and distinct."""
    zeros, poles = np.real(factors.zeros), np.real(factors.poles)
    direct = factors.gain * float(np.prod(poles / zeros))
    distances = poles[:, None] - poles
    np.fill_diagonal(distances, 1.0)
    residues = direct * np.prod((poles[:, None] - zeros) / distances, axis=1)
    share = np.sqrt(np.abs(residues))
    return np.diag(poles), share, np.sign(residues) * share, direct
