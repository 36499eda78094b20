"""Fractional systems with a pure delay: exact response, shifted steps, and the Nyquist margins of their loops."""

import control
import numpy as np
import pytest
from fractional_plants import AT, PODLUBNY, s

from workbench.base.errors import InputError
from workbench.control.fractional import fit_orders
from workbench.control.fractional.stability import stability

LATE = PODLUBNY.delayed(0.3)


def test_the_response_is_turned_and_the_step_later():
    assert LATE(AT) == pytest.approx(PODLUBNY(AT) * np.exp(-0.3 * AT))
    t = np.array([0.0, 0.2, 0.3, 0.5, 2.0])
    assert LATE.step(t) == pytest.approx([0, 0, 0, *PODLUBNY.step(t[3:] - 0.3)])
    assert (1 / (s + 1)).delayed(1).impulse(np.array([0.5, 1.0, 2.0])) == pytest.approx([0, 1, np.exp(-1)])
    assert repr(LATE) == "1/(0.8 s^2.2 + 0.5 s^0.9 + 1) exp(-0.3 s)"
    assert repr((s + 1).delayed(0.5)) == "(s + 1) exp(-0.5 s)"
    assert LATE.stability()
    assert float(LATE.h2_norm()) == float(PODLUBNY.h2_norm())


def test_delays_add_up_in_products_and_must_agree_in_sums():
    other = (2 / s**0.5).delayed(0.2)
    assert (LATE * other)(AT) == pytest.approx(LATE(AT) * other(AT))
    assert (LATE / other).delay == pytest.approx(0.1)
    assert (other**2)(AT) == pytest.approx(other(AT) ** 2)
    assert (LATE + (1 / s).delayed(0.3))(AT) == pytest.approx(LATE(AT) + np.exp(-0.3 * AT) / AT)
    assert LATE.delayed(-0.3) == PODLUBNY


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: LATE + PODLUBNY, "a sum of delays of 0.3 and 0 s"),
        (lambda: PODLUBNY / LATE, "a delay of -0.3 s would look ahead"),
        (lambda: LATE.feedback(), "see margins"),
        (lambda: LATE.oustaloup(0.01, 1), r"realise it without, .delayed\(-0.3\)"),
        (lambda: ((s + 1) / (s + 2)).margins(), "a numerator of a lower order"),
        (lambda: (1 / (s**2 + 1)).margins(), "a pole on the imaginary axis"),
    ],
)
def test_what_a_delay_makes_impossible_is_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        wrong()


@pytest.mark.parametrize(("power", "gain", "delay"), [(1.0, 0.7, 1.0), (0.5, 1.2, 0.5), (1.4, 0.4, 0.2)])
def test_margins_of_a_fractional_integrator_with_a_delay_are_their_closed_forms(power, gain, delay):
    """K exp(-T s)/s^a: crossover K^(1/a), -180 deg at w T = pi - a pi/2."""
    margins = (gain / s**power).delayed(delay).margins()
    crossover, turned = gain ** (1 / power), np.pi * (1 - power / 2)
    assert margins.stable
    assert margins.phase_margin_deg == pytest.approx(np.degrees(turned - crossover * delay), rel=1e-9)
    assert margins.gain_margin_db == pytest.approx(20 * np.log10((turned / delay) ** power / gain), rel=1e-9)
    assert margins.delay == pytest.approx(turned / crossover - delay, rel=1e-9)
    limit = (turned / delay) ** power
    assert (0.999 * limit / s**power).delayed(delay).margins().stable
    beyond = (1.001 * limit / s**power).delayed(delay).margins()
    assert (beyond.stable, beyond.unstable) == (False, 2)


@pytest.mark.parametrize(
    "loop",
    [
        (20.5 + 3.7343 * s**1.15) * PODLUBNY,
        (20.5 + s) * PODLUBNY,
        3 / (s * (s**0.5 + 1)),
        2 / (s - 1),
        0.5 / (s - 1),
    ],
)
def test_without_a_delay_closed_poles_are_those_of_the_closed_loop(loop):
    assert loop.margins().unstable == stability(loop.feedback().denominator).unstable
    assert loop.margins().stable == bool(loop.feedback().stability())


def test_whole_orders_have_the_margins_of_python_control():
    gain, phase, _, _, _, _ = control.stability_margins(control.tf([5], [1, 3, 3, 1]))[:6]
    found = (5 / (s + 1) ** 3).margins()
    assert found.gain_margin_db == pytest.approx(20 * np.log10(gain), rel=1e-6)
    assert found.phase_margin_deg == pytest.approx(phase, rel=1e-6)
    w = np.geomspace(0.1, 10, 100001)
    assert found.ms == pytest.approx(np.max(1 / np.abs(1 + 5 / (1j * w + 1) ** 3)), rel=1e-4)


def test_orders_are_fitted_with_a_delay_that_is_known():
    f = np.geomspace(0.01, 5, 60)
    fit = fit_orders(f, LATE.response(f), (1 / (0.7 * s**2 + 0.6 * s + 1.1)).delayed(0.3))
    assert fit.error < 1e-8
    assert fit.system(AT) == pytest.approx(LATE(AT))
