"""Poles of a fractional system and its stability: Matignon's theorem, and the argument principle for any orders."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from ...base.errors import InputError
from .polynomial import FractionalPolynomial, common_order

LARGEST_DEGREE = 200  # of a polynomial in s^q whose roots are computed
_SECTOR = 0.9 * np.pi  # poles nearer to the cut have decayed where they could matter
_RAYS = _SECTOR * np.array([1.0, 0.99, 0.98, 0.97, 0.96])
_GRID = 12, 24  # starts of Newton's method, over ln |s| by the decade and over the angle
_DOMINANT = 1e-3  # share that the other terms have at the ends of a ray: there the argument is that of one term
_SHARE = 0.7  # how far the value may move over an interval, of its size: less than 45 degrees
_NEAREST = 1e-11  # share of its terms that a polynomial may cancel to before it counts as zero
_HALVINGS = 60


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


def roots_in_sector(polynomial: FractionalPolynomial, angle: float) -> int | None:
    """Roots with 0 < |s| and |arg s| < angle [rad], angle <= pi, on the principal sheet; None where one is on the ray.

    n = ((alpha_n - alpha_0) angle - change of arg D along s = r exp(j angle), r from 0 to infinity) / pi. Along the ray
    a term changes by a_k (r_2^alpha_k - r_1^alpha_k) exp(j alpha_k angle), whose size is known: the ray is halved until
    D moves by less than its size between neighbours, so no turn is missed, whatever the orders.
    """
    lowest = polynomial.shifted(-polynomial.lowest)
    if len(lowest.terms) == 1:
        return 0
    turn = _turn(lowest, angle)
    return None if turn is None else round((float(lowest.highest) * angle - turn) / np.pi)


def scaled_terms(polynomial: FractionalPolynomial, log_r: np.ndarray) -> np.ndarray:
    """|a_k| r^alpha_k [k, n] at ln r [n], over the largest of them: neither overflows nor vanishes."""
    exponents = np.log(np.abs(polynomial.coefficients))[:, None] + polynomial.orders[:, None] * log_r
    return np.exp(exponents - exponents.max(axis=0))


def corner_range(polynomial: FractionalPolynomial, share: float = _DOMINANT) -> tuple[float, float]:
    """ln r below which the lowest term and above which the highest has all but `share` of the sum of sizes."""
    size, order = np.log(np.abs(polynomial.coefficients)), polynomial.orders
    margin = np.log(share / max(len(order) - 1, 1))
    low = min(((size[0] - size[1:] + margin) / (order[1:] - order[0])), default=0.0)
    high = max(((size[:-1] - size[-1] - margin) / (order[-1] - order[:-1])), default=0.0)
    return float(low), float(high)


def _turn(polynomial: FractionalPolynomial, angle: float) -> float | None:
    """Change of the argument [rad] along the ray; None where the value vanishes on it."""
    low, high = corner_range(polynomial)
    log_r = np.linspace(low, high, 200)
    turned = np.exp(1j * polynomial.orders * angle) * np.sign(polynomial.coefficients)
    for _ in range(_HALVINGS):
        sizes = scaled_terms(polynomial, log_r)
        value = turned @ sizes
        if np.any(np.abs(value) < _NEAREST * sizes.sum(axis=0)):
            return None
        growth = np.expm1(polynomial.orders[:, None] * np.diff(log_r)) * sizes[:, :-1]
        coarse = growth.sum(axis=0) > _SHARE * np.abs(value[:-1])
        if not coarse.any():
            steps = np.angle(value[1:] / value[:-1]).sum()
            return float(np.angle(value[0] / turned[0]) + steps + np.angle(turned[-1] / value[-1]))
        log_r = np.sort(np.append(log_r, (log_r[:-1] + log_r[1:])[coarse] / 2))
    return None
