"""Steps and impulses of fractional systems: closed forms, published series, and another inversion."""

from math import comb, exp, factorial, gamma, sqrt

import control
import numpy as np
import pytest
from fractional_plants import PLANTS, PODLUBNY, coefficient, s, size
from hypothesis import assume, given, settings, strategies as st
from scipy.special import erfcx

from workbench.control.fractional import FractionalTransferFunction
from workbench.control.fractional.stability import LARGEST_DEGREE


def mittag_leffler(a, b, z):
    """sum z^k/Gamma(a k + b), for |z| up to 5."""
    return sum(z**k / gamma(a * k + b) for k in range(int(160 / a)) if a * k + b < 170)


def podlubny_step(t):
    """The three-term equation's solution as a double series (Podlubny, Fractional Differential Equations, 1999)."""
    a, b, c = 0.8, 0.5, 1.0
    total = 0.0
    for k in range(60):
        for j in range(60):
            rise = 2.2 * (k + 1) + 1.3 * j
            if rise < 165:
                many = factorial(k + j) / (factorial(k) * factorial(j))
                total += (-1) ** (k + j) * many * c**k * b**j / a ** (k + j + 1) * t**rise / gamma(rise + 1)
    return total


T = np.array([1e-6, 1e-3, 0.1, 1.0, 3.0, 30.0, 1e4])


@pytest.mark.parametrize("power", [0.2, 0.5, 1.0, 1.7, 3.3])
def test_the_step_of_a_power_is_a_power(power):
    assert (2 / s**power).step(T) == pytest.approx(2 * T**power / gamma(power + 1), rel=1e-12)


def test_the_step_of_a_half_is_an_error_function():
    assert (1 / (s**0.5 + 1)).step(T) == pytest.approx(1 - erfcx(np.sqrt(T)), abs=1e-13)
    assert (1 / (s**0.5 + 1)).impulse(T) == pytest.approx(1 / np.sqrt(np.pi * T) - erfcx(np.sqrt(T)), rel=1e-8)


@pytest.mark.parametrize("power", [0.4, 0.8, 1.5, sqrt(2), np.pi / 2, 1.95])
@pytest.mark.parametrize("b", [0.3, 1.0])
def test_steps_and_impulses_of_one_mode_are_mittag_leffler_functions(power, b):
    """t^a E_{a,a+1}(-b t^a) and t^(a-1) E_{a,a}(-b t^a), orders rational or not."""
    g = 1 / (s**power + b)
    t = np.array([1e-3, 0.1, 0.7, 1.5])
    z = -b * t**power
    assert g.step(t) == pytest.approx(t**power * [mittag_leffler(power, power + 1, x) for x in z], rel=1e-10)
    assert g.impulse(t) == pytest.approx(t ** (power - 1) * [mittag_leffler(power, power, x) for x in z], rel=1e-9)


def test_the_step_of_podlubnys_plant_is_his_series():
    t = np.array([0.2, 1.0, 2.0, 3.5])
    assert PODLUBNY.step(t) == pytest.approx([podlubny_step(x) for x in t], rel=1e-9)


def test_a_resonance_of_many_periods_and_poles_that_coincide():
    t = np.linspace(0, 1000, 3000)
    w = sqrt(1 - 1e-4)
    wanted = 1 - np.exp(-0.01 * t) * (np.cos(w * t) + 0.01 / w * np.sin(w * t))
    assert (1 / (s**2 + 0.02 * s + 1)).step(t) == pytest.approx(wanted, abs=1e-11)
    t = t / 20
    assert (1 / (s + 1) ** 3).step(t) == pytest.approx(1 - np.exp(-t) * (1 + t + t**2 / 2), abs=1e-12)
    assert (1 / (s**2 + 1) ** 2).step(t) == pytest.approx(1 - np.cos(t) - t * np.sin(t) / 2, abs=1e-10)
    assert (1 / (s - 1)).step(np.array([2.0, 20.0])) == pytest.approx([exp(2) - 1, exp(20) - 1], rel=1e-11)


@settings(max_examples=12, deadline=None)
@given(st.lists(size, min_size=1, max_size=3), st.lists(st.tuples(st.floats(0.02, 0.9), size), max_size=1), coefficient)
def test_the_step_of_whole_orders_is_that_of_python_control(real, pairs, gain):
    below = np.poly([-root for root in real])
    for damping, w in pairs:
        below = np.polymul(below, [1, 2 * damping * w, w**2])
    t = np.linspace(0, 5, 40)
    g = FractionalTransferFunction.of([(0, gain)], [(k, float(x)) for k, x in enumerate(below[::-1])])
    wanted = np.array(control.step_response(control.tf([gain], below), t).outputs)
    assert g.step(t) == pytest.approx(wanted, abs=1e-7 * float(np.abs(wanted).max()))


def along_a_line(transform, t, terms=4000):
    """Inverse Laplace transform by Euler's summation (Abate and Whitt, ORSA J. Computing 7(1), 1995)."""
    shift, averaged = 20.0, 14
    k = np.arange(1, terms + averaged)
    parts = (-1.0) ** k * np.real(transform((shift + 2j * np.pi * k) / (2 * t)))
    sums = np.real(transform(np.array(shift / (2 * t) + 0j))) / 2 + np.cumsum(parts)
    weights = np.array([comb(averaged, j) for j in range(averaged)]) / 2**averaged
    return exp(shift / 2) / t * (weights @ sums[terms - 1 : terms - 1 + averaged]) / weights.sum()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.floats(0.1, 1.9), size), min_size=1, max_size=4), size, st.floats(0.05, 20))
def test_steps_on_contours_are_those_along_a_line(terms, constant, t):
    """Any orders: two ways that share nothing but the transform. The line is as near as more of its terms move it."""
    g = FractionalTransferFunction.of([(0, 1.0)], [*terms, (0, constant)])
    assume(np.diff(g.denominator.orders).min() > 0.01)
    assert g.stability()
    found = g.step(np.array([t]))[0]
    half, line = (along_a_line(lambda at: g(at) / at, t, count) for count in (2000, 4000))
    assert found == pytest.approx(line, abs=1e-6 / constant + 2 * abs(line - half))


def test_the_step_of_a_half_order_is_its_error_function():
    """1/(a s^(1/2) + c): (1 - exp(x^2) erfc(x))/c with x = c sqrt(t)/a (Podlubny, Fractional Differential Equations,
    1999, ch. 1). A line is 3e-6 off there."""
    a, c, t = 0.109375, 3.0, np.array([0.05, 5.0, 20.0])
    g = FractionalTransferFunction.of([(0, 1.0)], [(0.5, a), (0, c)])
    assert g.step(t) == pytest.approx((1 - erfcx(c / a * np.sqrt(t))) / c, rel=1e-12)


@pytest.mark.parametrize("plant", PLANTS)
def test_orders_that_are_rounded_move_the_step_a_little(plant):
    """Degrees of 22 to 3501: the same contour, poles by roots or by Newton's method."""
    t = np.geomspace(0.01, 30, 40)
    parts = ([(round(float(k), 1), a) for k, a in part.terms] for part in (plant.numerator, plant.denominator))
    rounded = FractionalTransferFunction.of(*parts)
    assert rounded.denominator.highest / rounded.order <= LARGEST_DEGREE
    assert plant.step(t) == pytest.approx(rounded.step(t), rel=0.3, abs=0.15 * np.abs(plant.step(t)).max())


def test_the_start_is_the_limit():
    zero = np.array([0.0])
    assert ((2 * s + 1) / (s + 3)).step(zero) == pytest.approx([2.0])
    assert (1 / (s**0.5 + 1)).step(zero) == pytest.approx([0.0])
    assert (1 / (s**0.5 + 1)).impulse(zero) == [np.inf]
    assert (3 / (s + 1)).impulse(zero) == pytest.approx([3.0])
