"""Stability of fractional systems: published roots and angles, Matignon's theorem and the argument principle."""

from fractions import Fraction
from math import sqrt

import numpy as np
import pytest
from fractional_plants import PLANTS, PODLUBNY, coefficient, s, size
from hypothesis import assume, given, settings, strategies as st

from workbench.control.fractional import FractionalPolynomial, FractionalTransferFunction
from workbench.control.fractional.polynomial import order_of
from workbench.control.fractional.stability import roots_in_powers_of, roots_in_sector


def test_the_published_roots_and_angles():
    """Petráš, Fractional Calculus and Applied Analysis 12(3), 2009: 1.0045 +- 0.1684 j, 0.1661 rad > pi/20."""
    roots = roots_in_powers_of(PODLUBNY.denominator, Fraction(1, 10))
    assert len(roots) == 22
    first = roots[np.argmin(np.abs(np.angle(roots)))]
    assert (first.real, abs(first.imag)) == pytest.approx((1.0045, 0.1684), abs=1e-4)
    found = PODLUBNY.stability()
    assert found
    assert found.angle == pytest.approx(0.1661, abs=1e-4)
    assert found.reason == "least |arg| of the poles in s^0.1 is 0.1661 rad > q pi/2 = 0.1571 rad"


def test_fomcons_plants_are_stable_and_the_third_has_no_commensurate_order_of_use():
    assert all(plant.stability() for plant in PLANTS)
    third = PLANTS[2].stability()
    assert third.order is None
    assert third.reason.startswith("no commensurate order of use: s^0.001 would need degree 3.5e+03; 0 poles right")
    assert not (1 / (s ** sqrt(2) - s + 1)).stability()
    assert (1 / (s ** sqrt(2) + 1)).stability()


@pytest.mark.parametrize(
    ("law", "stable"),
    [(20.5 + 2.7343 * s, True), (20.5 + 3.7343 * s**1.15, True), (20.5 + s, False), (20.5 + s**1.15, True)],
)
def test_podlubnys_loops(law, stable):
    """With Td = 1 his integer controller loses its plant, the fractional one does not."""
    assert bool((law * PODLUBNY).feedback().stability()) is stable


@pytest.mark.parametrize(
    ("denominator", "stable", "reason"),
    [
        (s**1.9 + 1, True, "least"),
        (s**2 + 1, False, "a pole on the imaginary axis"),
        (s**2.1 + 1, False, "least"),
        (s**0.5, False, "a pole of order 0.5 at s = 0"),
        (s**0.5 + 1, True, "least"),
        (s**0.5 - 1, False, "least"),
        (s - 2 * s**0.5 + 1.9, False, "least"),
        (s - 2 * s**0.5 + 2.1, True, "least"),
        (s - 2 * s**0.5 + 1, False, "least"),
    ],
)
def test_stability_of_known_systems(denominator, stable, reason):
    """Angles of the roots in s^q: Matignon, CESA 1996."""
    found = (1 / denominator).stability()
    assert bool(found) is stable
    assert found.reason.startswith(reason)


@given(st.lists(coefficient, min_size=2, max_size=6), st.sampled_from([0.1, 0.3, 0.5, 0.7, 1.0, 1.3, 1.7]))
def test_the_argument_principle_counts_matignons_roots(numbers, q):
    """Every root in s^q within q angle is one of the sector, whatever q."""
    polynomial = FractionalPolynomial.of((order_of(q) * k, value) for k, value in enumerate(numbers))
    angles = np.abs(np.angle(np.roots(numbers[::-1]))) / q
    for sector in (np.pi / 2, 0.9 * np.pi if q <= 1 else 1.0):
        assume(np.abs(angles - sector).min() > 1e-4)
        assert roots_in_sector(polynomial, sector) == np.sum(angles < sector)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(0.15, 3.5), coefficient), min_size=1, max_size=3), size)
def test_poles_of_orders_with_nothing_in_common_are_all_found(terms, constant):
    polynomial = FractionalPolynomial.of([*terms, (0, constant)])
    gaps = np.diff(polynomial.orders)
    assume(len(gaps) and gaps.min() > 0.1)
    poles = FractionalTransferFunction(FractionalPolynomial.of([(0, 1.0)]), polynomial).poles()
    sizes = np.sum([abs(a) * np.abs(poles) ** float(k) for k, a in polynomial.terms], axis=0)
    assert np.all(np.abs(polynomial(poles)) < 1e-8 * sizes)
