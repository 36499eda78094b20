"""The H2 norm of fractional systems: closed forms, published values, Gramians, and its own bound."""

from math import sqrt

import numpy as np
import pytest
from fractional_plants import THIRD_DENOMINATOR, coefficient, s, size
from hypothesis import assume, given, settings, strategies as st
from scipy.linalg import solve_continuous_lyapunov

from workbench.control.fractional import FractionalTransferFunction
from workbench.control.fractional.norm import _by_integral, _by_residues
from workbench.linear.state_space import transfer_function


@pytest.mark.parametrize("power", [0.6, 0.75, 1.0, 1.25, 1.6])
@pytest.mark.parametrize("b", [0.2, 3.0])
def test_the_norm_of_one_mode_is_its_closed_form(power, b):
    """K/(s^n + b): K^2 b^(1/n - 2) sin((p - 1) n pi/2)/(n sin(n pi/2) sin((p - 1) pi)), p = 1/n.

    Gradshteyn and Ryzhik, 3.252.12; the system of Malti et al., Energy of fractional order transfer functions, 2002.
    """
    p, angle = 1 / power, power * np.pi / 2
    ratio = angle / np.pi if power == 1 else np.sin((p - 1) * angle) / np.sin((p - 1) * np.pi)
    wanted = 2 * sqrt(b ** (p - 2) / power * ratio / np.sin(angle))
    found = (2 / (s**power + b)).h2_norm()
    assert found.method == "residues"
    assert found.value == pytest.approx(wanted, rel=1e-10)
    assert found.error < 1e-9 * wanted


def test_published_norms():
    """Chen, Petráš, Xue, American Control Conference 2009: H2 2.7168, H infinity 8.6115."""
    plant = (-2 * s**0.63 - 4) / THIRD_DENOMINATOR
    assert float(plant.h2_norm()) == pytest.approx(2.7168, abs=5e-5)
    assert np.abs(plant.response(np.geomspace(0.01, 1, 20000))).max() == pytest.approx(8.6115, abs=5e-5)


@settings(max_examples=40, deadline=None)
@given(st.lists(size, min_size=2, max_size=4), st.lists(coefficient, min_size=1, max_size=2))
def test_the_norm_of_whole_orders_is_that_of_the_gramian(roots, above):
    below = np.poly([-root for root in roots])
    a, b, c, _ = transfer_function(above, below)
    wanted = sqrt((c @ solve_continuous_lyapunov(a, -b @ b.T) @ c.T).item())
    g = FractionalTransferFunction.of(*([(k, float(x)) for k, x in enumerate(part[::-1])] for part in (above, below)))
    found = g.h2_norm()
    assert found.value == pytest.approx(wanted, rel=1e-6)
    assert abs(found.value - wanted) < found.error + 1e-6 * wanted


def test_the_norm_of_a_needle_of_a_resonance():
    """Two coinciding pairs, damping 5e-5: the integral finds the peak; against the Gramian."""
    g = 1 / (s**2 + 1e-4 * s + 1) ** 2
    a, b, c, _ = transfer_function([1.0], np.polymul([1, 1e-4, 1], [1, 1e-4, 1]).tolist())
    wanted = sqrt((c @ solve_continuous_lyapunov(a, -b @ b.T) @ c.T).item())
    found = g.h2_norm()
    assert found.method == "integral"
    assert found.value == pytest.approx(wanted, rel=1e-6)
    assert found.error < 1e-6 * wanted


@settings(max_examples=30, deadline=None)
@given(size, size, coefficient, st.sampled_from([0.35, 0.4, 0.55, 0.7, 0.9]))
def test_residues_and_integral_agree(first, second, above, q):
    """And the integral's bound holds."""
    assume(abs(first - second) > 0.05)
    g = (above + s**q) / ((s**q + first) * (s**q + second) * (s**q + 20))
    residues, error = _by_residues(g.numerator, g.denominator)
    integral, bound = _by_integral(g.numerator, g.denominator)
    assert abs(residues - integral) <= error + bound + 1e-11 * integral
    assert bound < 1e-6 * integral


@pytest.mark.parametrize(
    ("g", "reason"),
    [
        (1 / (s**0.5 + 1), "above the numerator's by 1/2 or less"),
        (1 / (s**0.5 * (s + 1)), "a pole at s = 0 of order 1/2"),
        (1 / (s - 1), "a pole in the closed right half plane"),
        (1 / (s**2 + 1), "a pole in the closed right half plane"),
    ],
)
def test_an_infinite_norm_says_why(g, reason):
    found = g.h2_norm()
    assert found.value == np.inf
    assert reason in found.reason


def test_a_norm_at_the_edge_is_finite_and_right():
    """1/(s^0.3 (s + 1)): 1/pi integral w^-0.6/(w^2 + 1) dw = 1/(2 sin(0.2 pi))."""
    found = (1 / (s**0.3 * (s + 1))).h2_norm()
    assert found.value == pytest.approx(sqrt(0.5 / np.sin(0.2 * np.pi)), rel=1e-8)
