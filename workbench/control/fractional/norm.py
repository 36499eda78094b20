"""The H2 norm of a fractional system: by residues in s^q, or by the integral of its frequency response."""

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Literal

import numpy as np

from .polynomial import FractionalPolynomial, common_order
from .stability import LARGEST_DEGREE, corner_range, poles, roots_in_powers_of, roots_in_sector, scaled_terms

_TAIL = 1e-9  # share of the integral's tails that lies beyond their leading terms
_ROUNDING = 1e-15  # of a pole, of a term
_ACCURATE = 1e-9  # relative error up to which residues are taken


@dataclass(frozen=True)
class H2Norm:
    """||G|| = sqrt(1/pi integral of |G(j w)|^2 dw, 0 to infinity), with its error bound; or why it is infinite."""

    value: float
    error: float
    method: Literal["residues", "integral", "infinite"]
    reason: str = ""

    def __float__(self) -> float:
        return self.value


def h2_norm(numerator: FractionalPolynomial, denominator: FractionalPolynomial) -> H2Norm:
    """The norm of numerator/denominator.

    It is finite where the difference of the highest orders is above 1/2, a pole of s = 0 is of an order below 1/2 and
    no other is in the closed right half plane. Malti, Aoun, Levron, Oustaloup, Automatica 47(11), 2011, give the
    residues for commensurate orders; the integral takes any orders, and poles that coincide.
    """
    if not numerator.terms:
        return H2Norm(0.0, 0.0, "residues")
    if reason := _infinite(numerator, denominator):
        return H2Norm(np.inf, 0.0, "infinite", reason)
    square, error = _by_residues(numerator, denominator)
    method: Literal["residues", "integral"] = "residues"
    if not error < _ACCURATE * square:
        (square, error), method = _by_integral(numerator, denominator), "integral"
    value = float(np.sqrt(square))
    return H2Norm(value, float(error / (2 * value)), method)


def _infinite(numerator: FractionalPolynomial, denominator: FractionalPolynomial) -> str:
    half = Fraction(1, 2)
    if denominator.highest - numerator.highest <= half:
        return "the denominator's highest order is above the numerator's by 1/2 or less"
    if denominator.lowest - numerator.lowest >= half:
        return "a pole at s = 0 of order 1/2 or more"
    if roots_in_sector(denominator, np.pi / 2) != 0:
        return "a pole in the closed right half plane"
    return ""


@np.errstate(divide="ignore", invalid="ignore")  # of poles that coincide, which residues do not do
def _by_residues(numerator: FractionalPolynomial, denominator: FractionalPolynomial) -> tuple[float, float]:
    """||G||^2 and what rounding may take of it, infinite where this does not do: 1/(pi q) integral of y^(p-1) R(y) dy.

    y = w^q, p = 1/q, R = N N*/(D D*), N* the conjugate. The integral is -pi exp(-j pi p)/sin(pi p) times the sum of the
    residues of y^(p-1) R with 0 < arg y < 2 pi; for a whole p minus that of the residues of y^(p-1) R ln y.
    """
    order = common_order(power for part in (numerator, denominator) for power, _ in part.terms)
    if denominator.lowest > 0 or denominator.highest / order > LARGEST_DEGREE:
        return np.nan, np.inf
    sigma, p = roots_in_powers_of(denominator, order), float(1 / order)
    n, d = (np.polynomial.Polynomial(part.in_powers_of(order)) for part in (numerator, denominator))
    total = size = 0.0
    for turn in np.exp(0.5j * np.pi * float(order) * np.array([1, -1])):
        y = sigma / turn
        log = np.log(np.abs(y)) + 1j * np.mod(np.angle(y), 2 * np.pi)
        residue = n(sigma) * n(y / turn) / (turn * d.deriv()(sigma) * d(y / turn))
        parts = -residue * np.exp((p - 1) * log)
        parts = parts * (log if p.is_integer() else np.pi * np.exp(-1j * np.pi * p) / np.sin(np.pi * p))
        total, size = total + parts.sum().real, size + np.abs(parts).sum()
    separation = np.abs(sigma[:, None] - sigma) + np.diag(np.abs(sigma))
    loss = np.max(np.abs(sigma)[:, None] / separation) ** 2  # of the roots, and of the residues by them
    error = _ROUNDING * len(sigma) * size * loss / (np.pi * float(order))
    return (float(total / (np.pi * float(order))), float(error)) if np.isfinite(error) else (np.nan, np.inf)


def _by_integral(numerator: FractionalPolynomial, denominator: FractionalPolynomial) -> tuple[float, float]:
    """||G||^2 and a bound of its error: over x = ln w by Gauss-Kronrod between corners and poles, the ends by leading
    terms. Raises InputError as `poles` does."""
    from scipy.integrate import quad

    def density(x: float) -> float:
        return float(np.exp(_log_gain(numerator, denominator, np.array([x]))[0] * 2 + x))

    ranges = [corner_range(part, _TAIL) for part in (numerator, denominator)]
    low, high = min(low for low, _ in ranges), max(high for _, high in ranges)
    slopes = (
        float(2 * (numerator.lowest - denominator.lowest) + 1),
        float(2 * (denominator.highest - numerator.highest) - 1),
    )
    tails = density(low) / slopes[0] + density(high) / slopes[1]
    inner = np.concatenate([_corners(numerator), _corners(denominator), np.log(np.abs(poles(denominator)))])
    edges = np.unique([low, high, *inner[(inner > low) & (inner < high)]])
    pieces = [quad(density, a, b, epsabs=0, epsrel=1e-11, limit=400, full_output=1)[:2] for a, b in pairwise(edges)]
    inside, error = np.sum(pieces, axis=0)
    rounding = _ROUNDING * max(_cancellation(part, edges) for part in (numerator, denominator))
    return float((inside + tails) / np.pi), float((error + rounding * inside + 8 * _TAIL * tails) / np.pi)


def _log_gain(numerator: FractionalPolynomial, denominator: FractionalPolynomial, x: np.ndarray) -> np.ndarray:
    """ln |G(j e^x)| [n], at any x: neither numerator nor denominator overflows."""
    top, bottom = (_log_size(part, x) for part in (numerator, denominator))
    return top - bottom


def _log_size(polynomial: FractionalPolynomial, x: np.ndarray) -> np.ndarray:
    turned = np.sign(polynomial.coefficients) * np.exp(0.5j * np.pi * polynomial.orders)
    largest = (np.log(np.abs(polynomial.coefficients))[:, None] + polynomial.orders[:, None] * x).max(axis=0)
    with np.errstate(divide="ignore"):
        return largest + np.log(np.abs(turned @ scaled_terms(polynomial, x)))


def _cancellation(polynomial: FractionalPolynomial, x: np.ndarray) -> float:
    """By how much the terms are larger than their sum, at worst, at w = e^x: where rounding counts."""
    sizes = scaled_terms(polynomial, x)
    turned = np.sign(polynomial.coefficients) * np.exp(0.5j * np.pi * polynomial.orders)
    return float(np.max(sizes.sum(axis=0) / np.abs(turned @ sizes)))


def _corners(polynomial: FractionalPolynomial) -> np.ndarray:
    """ln w at which two terms that follow each other are equal, and a decade around: where the gain bends."""
    size, order = np.log(np.abs(polynomial.coefficients)), polynomial.orders
    x = -np.diff(size) / np.diff(order)
    return (x[:, None] + np.array([-2.3, -0.5, 0.0, 0.5, 2.3])).ravel()
