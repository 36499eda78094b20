"""How many roots of a fractional polynomial lie in a sector about the positive real axis: the argument principle."""

import numpy as np

from .polynomial import FractionalPolynomial

_DOMINANT = 1e-3  # share that the other terms have at the ends of a ray: there the argument is that of one term
_SHARE = 0.7  # how far the value may move over an interval, of its size: less than 45 degrees
_NEAREST = 1e-11  # share of its terms that a polynomial may cancel to before it counts as zero
_HALVINGS = 60


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
