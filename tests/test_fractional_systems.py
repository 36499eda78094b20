"""Fractional systems as objects: arithmetic against that of their responses, exact orders, refusals."""

from fractions import Fraction

import numpy as np
import pytest
from fractional_plants import AT, PODLUBNY, s, size, system
from hypothesis import assume, given, strategies as st

from workbench.base.errors import InputError
from workbench.control.fractional.polynomial import common_order, order_of


def near(found, wanted, cancelled):
    """To 1e-9 of what was summed up, and only where no denominator vanishes."""
    assert np.abs(found - wanted) == pytest.approx(np.zeros(len(AT)), abs=1e-9 * float(np.max(cancelled)))


@given(system, system, st.floats(-5, 5))
def test_arithmetic_is_that_of_responses(one, other, factor):
    a, b = one(AT), other(AT)
    assume(all(np.abs(part(AT)).min() > 1e-2 for each in (one, other) for part in (each.numerator, each.denominator)))
    size = (1 + np.abs(a) + np.abs(b)) ** 2
    near((one + other)(AT), a + b, size)
    near((one - other)(AT), a - b, size)
    near((one * other)(AT), a * b, size)
    near((one / other)(AT), a / b, np.abs(a / b))
    near((factor + one * factor)(AT), factor * (1 + a), size * (1 + abs(factor)))
    near((factor - one)(AT), factor - a, size * (1 + abs(factor)))
    near((2.0 / one)(AT), 2 / a, np.abs(2 / a))
    near((one**3)(AT), a**3, np.abs(a) ** 3)
    near((one**-2)(AT), a**-2.0, np.abs(a) ** -2.0)
    assume(np.abs(1 + a * b).min() > 1e-2)
    near(one.feedback(other)(AT), a / (1 + a * b), np.abs(a / (1 + a * b)) * 100 + 1)


@given(st.floats(-3, 3), size)
def test_a_power_of_s_is_that_of_its_definition(power, gain):
    """|w|^a at an angle of a 90 degrees."""
    g = gain * s**power
    assert np.abs(g(AT)) == pytest.approx(gain * np.abs(AT) ** float(order_of(power)))
    assert np.angle(g(AT) * np.exp(-0.5j * np.pi * power)) == pytest.approx(np.zeros(len(AT)), abs=1e-9)
    assert ((4 * s**power) ** 0.5)(AT) == pytest.approx(2 * AT ** (power / 2))


def test_orders_are_exact():
    assert order_of(2.2) == Fraction(11, 5)
    assert order_of(1 / 3) == Fraction(1, 3)
    assert (s**0.1 * s**0.2).numerator.terms == ((Fraction(3, 10), 1.0),)
    assert PODLUBNY.order == Fraction(1, 10)
    assert common_order([Fraction(3, 2), Fraction(0), Fraction(9, 4)]) == Fraction(3, 4)
    assert (1 / s**0.5 * s**0.5).denominator.terms == ((Fraction(0), 1.0),)
    assert repr(1 / (s**0.5 - 1)) == "1/(s^0.5 - 1)"
    assert repr((s - 1) / (2 * s**1.5 - s)) == "(s - 1)/(2 s^1.5 - s)"


def test_a_numpy_number_is_a_number():
    assert (np.float64(2) * PODLUBNY)(AT) == pytest.approx(2 * PODLUBNY(AT))
    assert (np.float64(2) + PODLUBNY)(AT) == pytest.approx(2 + PODLUBNY(AT))
    assert [panel.y_label for panel in PODLUBNY.bode(0.01, 10).panels] == ["gain [dB]", "phase [deg]"]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: s / 0, "divided by 0"),
        (lambda: s ** float("nan"), "order nan: must be a finite number"),
        (lambda: float("inf") * s, "coefficient inf"),
        (lambda: (s + 1) ** 0.5, "is no sum of powers"),
        (lambda: PODLUBNY.step(np.array([-1.0])), "times must be finite and not below 0"),
        (lambda: (1 / PODLUBNY).oustaloup(0.1, 1), "has no state space"),
        (lambda: PODLUBNY.oustaloup(2, 1), "band 2 to 1 Hz"),
        (lambda: PODLUBNY.least_squares(0.1, 1, 0), "0 states: must be 1 to 20"),
        (lambda: (1 / (s - 1)).least_squares(0.1, 1, 3), "the system is unstable"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(wrong, message):
    with pytest.raises(InputError, match=message) as caught:
        wrong()
    assert "\n" not in str(caught.value)
