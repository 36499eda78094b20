"""Poles of a fractional system and its stability: Matignon's theorem, and the argument principle for any orders."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from ...base.errors import InputError
from .polynomial import FractionalPolynomial, common_order
from .winding import corner_range, roots_in_sector

LARGEST_DEGREE = 200  # of a polynomial in s^q whose roots are computed
_SECTOR = 0.9 * np.pi  # poles nearer to the cut have decayed where they could matter
_RAYS = _SECTOR * np.array([1.0, 0.99, 0.98, 0.97, 0.96])
_GRID = 12, 24  # starts of Newton's method, over ln |s| by the decade and over the angle


@dataclass(frozen=True)
class Stability:
    """Whether all poles are in the open left half plane of the principal sheet.

    `order` is the commensurate order q, None where there is none of use; `angle` [rad] the least |arg| of the roots in
    s^q, which Matignon's theorem holds against q pi/2; `unstable` the poles with a real part above 0; `reason` one
    sentence on how it was found.
    """

    stable: bool
    order: Fraction | None
    angle: float | None
    unstable: int
    reason: str

    def __bool__(self) -> bool:
        return self.stable


def stability(denominator: FractionalPolynomial) -> Stability:
    """By |arg sigma| > q pi/2 for all roots of the denominator in sigma = s^q, else by the argument principle.

    q is the largest order that divides all orders, which are fractions, so it is exact (Matignon, Stability results for
    fractional differential equations, CESA 1996). A degree in s^q above 200 makes no use of it: then the roots in the
    right half plane are counted along the imaginary axis, whatever the orders. No zero cancels a pole.
    """
    if denominator.lowest > 0:
        return Stability(False, None, None, 0, f"a pole of order {float(denominator.lowest):g} at s = 0")
    order = common_order(power for power, _ in denominator.terms)
    degree = denominator.highest / order
    count = roots_in_sector(denominator, np.pi / 2)
    if count is None:
        return Stability(False, None, None, 0, "a pole on the imaginary axis, within rounding")
    if degree > LARGEST_DEGREE:
        reason = f"no commensurate order of use: s^{float(order):.3g} would need degree {float(degree):.3g}; "
        return Stability(
            not count, None, None, count, reason + f"{count} poles right of the imaginary axis, counted along it"
        )
    angle = float(min(np.abs(np.angle(roots_in_powers_of(denominator, order))), default=np.pi))
    limit = float(order) * np.pi / 2
    sign = ">" if angle > limit else "<="
    reason = f"least |arg| of the poles in s^{float(order):g} is {angle:.4g} rad {sign} q pi/2 = {limit:.4g} rad"
    return Stability(not count and angle > limit, order, angle, count, reason)


def poles(denominator: FractionalPolynomial) -> np.ndarray:
    """Poles [rad/s] on the principal sheet with |arg s| < 0.9 pi, none of them at s = 0, complex [n].

    From the roots in s^q, or by Newton's method from a grid where that degree is above 200; their number is checked by
    the argument principle. Raises InputError where it does not agree.
    """
    rest = denominator.shifted(-denominator.lowest)
    order = common_order(power for power, _ in rest.terms)
    for ray in _RAYS:
        if (count := roots_in_sector(rest, ray)) is None:
            continue
        if rest.highest / order <= LARGEST_DEGREE:
            s = _on_principal_sheet(roots_in_powers_of(rest, order), float(order))
        else:
            s = _by_newton(rest)
        s = s[np.abs(np.angle(s)) < ray]
        if len(s) == count:
            return s
    raise InputError(f"the poles of 1/({rest}) could not all be found; round its orders to two digits")


def _on_principal_sheet(sigma: np.ndarray, order: float) -> np.ndarray:
    """All s [n] with s^order = sigma [k] and |arg s| < pi."""
    sheets = int(np.ceil(order / 2))
    turns = np.angle(sigma) + 2 * np.pi * np.arange(-sheets, sheets + 1)[:, None]
    there = np.abs(turns) < order * np.pi
    return np.exp((np.log(np.abs(sigma)) + 1j * turns)[there] / order)


def roots_in_powers_of(polynomial: FractionalPolynomial, order: Fraction) -> np.ndarray:
    """Roots in s^order, of coefficients scaled so that the roots are about 1."""
    dense = polynomial.in_powers_of(order)
    n = len(dense) - 1
    if not n:
        return np.array([], complex)
    scale = abs(dense[0] / dense[-1]) ** (1 / n) if dense[0] else 1.0
    return scale * np.roots((dense * scale ** np.arange(n + 1.0))[::-1]).astype(complex)


def _by_newton(polynomial: FractionalPolynomial) -> np.ndarray:
    """Distinct roots that Newton's method in ln s comes to from a grid over the upper half of the principal sheet."""
    low, high = corner_range(polynomial, 0.5)
    rows = int(np.ceil((high - low) / np.log(10))) + 2
    x = np.linspace(low - 1, high + 1, _GRID[0] * rows) + 1j * np.linspace(0, np.pi, _GRID[1])[:, None]
    x = x.ravel()
    orders, logs = polynomial.orders[:, None], np.log(polynomial.coefficients.astype(complex))[:, None]
    step = np.ones_like(x)
    for _ in range(60):
        exponents = logs + orders * x
        terms = np.exp(exponents - exponents.real.max(axis=0))
        slope = (orders * terms).sum(axis=0)
        step = terms.sum(axis=0) / np.where(slope == 0, 1, slope)
        x = x - step * np.minimum(1, 0.3 / np.maximum(np.abs(step), 1e-300))
    x = x[(np.abs(step) < 1e-12) & (x.imag > -1e-9) & (x.imag < np.pi)]
    distinct: list[complex] = []
    for root in x:
        if all(abs(root - other) > 1e-7 for other in distinct):
            distinct.append(complex(root))
    real = [root.real for root in distinct if abs(root.imag) < 1e-9]
    pairs = [root for root in distinct if abs(root.imag) >= 1e-9]
    return np.exp(np.array([*real, *pairs, *np.conj(pairs)], complex))
