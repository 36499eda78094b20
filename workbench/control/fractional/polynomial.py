"""Sums of fractional powers of s, their orders kept as exact fractions."""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, isfinite, lcm

import numpy as np

from ...base.errors import InputError

_LARGEST_DENOMINATOR = 1000  # of an order that a float stands for: 0.3333333333333333 is 1/3


def order_of(value: float | Fraction) -> Fraction:
    """An order as a fraction: the simple fraction that a float is nearest to, else its decimal digits.

    Raises InputError for an order that is no finite number.
    """
    if isinstance(value, Fraction):
        return value
    if not isfinite(value):
        raise InputError(f"order {value}: must be a finite number")
    simple = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
    return simple if float(simple) == value else Fraction(repr(float(value)))


@dataclass(frozen=True)
class FractionalPolynomial:
    """sum of a_k s^alpha_k: `terms` (alpha_k, a_k), the orders rising and distinct, no a_k zero."""

    terms: tuple[tuple[Fraction, float], ...]

    @classmethod
    def of(cls, terms: Iterable[tuple[float | Fraction, float]]) -> "FractionalPolynomial":
        """Pairs (order, coefficient) in any order; those of one order add up.

        Raises InputError for an order or a coefficient that is no finite number.
        """
        total: dict[Fraction, float] = {}
        for order, coefficient in terms:
            if not isfinite(coefficient):
                raise InputError(f"coefficient {coefficient} of s^{order}: must be a finite number")
            exact = order_of(order)
            total[exact] = total.get(exact, 0.0) + float(coefficient)
        return cls(tuple((order, total[order]) for order in sorted(total) if total[order]))

    @property
    def orders(self) -> np.ndarray:
        """alpha_k [n], rising."""
        return np.array([float(order) for order, _ in self.terms])

    @property
    def coefficients(self) -> np.ndarray:
        """a_k [n], in the order of `orders`."""
        return np.array([coefficient for _, coefficient in self.terms])

    @property
    def lowest(self) -> Fraction:
        """The lowest order."""
        return self.terms[0][0]

    @property
    def highest(self) -> Fraction:
        """The highest order."""
        return self.terms[-1][0]

    def __call__(self, s: complex | np.ndarray) -> np.ndarray:
        """Its value at s [...], on the principal branch: s^alpha = |s|^alpha exp(j alpha arg s), -pi < arg s <= pi."""
        s = np.asarray(s, complex)
        with np.errstate(divide="ignore", invalid="ignore"):
            powers = [
                coefficient * s ** float(order) if order else coefficient + 0 * s for order, coefficient in self.terms
            ]
        return np.sum(powers, axis=0) if powers else np.zeros_like(s)

    def __add__(self, other: "FractionalPolynomial") -> "FractionalPolynomial":
        return FractionalPolynomial.of((*self.terms, *other.terms))

    def __mul__(self, other: "FractionalPolynomial") -> "FractionalPolynomial":
        return FractionalPolynomial.of((a + b, x * y) for a, x in self.terms for b, y in other.terms)

    def scaled(self, factor: float) -> "FractionalPolynomial":
        """It times a number."""
        return FractionalPolynomial.of((order, factor * coefficient) for order, coefficient in self.terms)

    def shifted(self, order: Fraction) -> "FractionalPolynomial":
        """It times s^order."""
        return FractionalPolynomial(tuple((own + order, coefficient) for own, coefficient in self.terms))

    def derivative(self) -> "FractionalPolynomial":
        """With respect to s."""
        return FractionalPolynomial.of((order - 1, float(order) * coefficient) for order, coefficient in self.terms)

    def in_powers_of(self, order: Fraction) -> np.ndarray:
        """Coefficients [n + 1], lowest first, of it as a polynomial of s^order, which divides all of its orders."""
        places = [int(own / order) for own, _ in self.terms]
        dense = np.zeros(max(places, default=0) + 1)
        dense[places] = self.coefficients
        return dense

    def __str__(self) -> str:
        return " + ".join(map(_written, reversed(self.terms))).replace("+ -", "- ") or "0"


def common_order(orders: Iterable[Fraction]) -> Fraction:
    """The largest order that divides all: gcd of the numerators over lcm of the denominators; 1 where all are 0."""
    used = [order for order in orders if order]
    if not used:
        return Fraction(1)
    denominator = lcm(*(order.denominator for order in used))
    return Fraction(gcd(*(int(order * denominator) for order in used)), denominator)


def _written(term: tuple[Fraction, float]) -> str:
    order, coefficient = term
    number = f"{coefficient:g}"
    if not order:
        return number
    power = "s" if order == 1 else f"s^{float(order):g}"
    return {"1": power, "-1": f"-{power}"}.get(number, f"{number} {power}")
