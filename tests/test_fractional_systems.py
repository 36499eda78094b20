"""Fractional systems as objects: against complex arithmetic, integer orders, closed forms and published examples."""

from fractions import Fraction
from math import comb, exp, factorial, gamma, sqrt

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_lyapunov
from scipy.special import erfcx

import workbench as wb
from workbench.base.errors import InputError
from workbench.control.fractional import FractionalPolynomial, FractionalTransferFunction, fit_orders
from workbench.control.fractional.norm import _by_integral, _by_residues
from workbench.control.fractional.polynomial import common_order, order_of
from workbench.control.fractional.stability import LARGEST_DEGREE, roots_in_powers_of
from workbench.control.fractional.winding import roots_in_sector
from workbench.linear.state_space import transfer_function

s = FractionalTransferFunction.s
# Podlubny, IEEE Trans. Automatic Control 44(1), 1999; the third plant of FOMCON's examples, which is also that of
# Chen, Petráš, Xue, Fractional order control - a tutorial, American Control Conference 2009, but for a sign
PODLUBNY = 1 / (0.8 * s**2.2 + 0.5 * s**0.9 + 1)
FURNACE = 1 / (14994 * s**1.31 + 6009.5 * s**0.97 + 1.69)
THIRD_DENOMINATOR = 2 * s**3.501 + 3.8 * s**2.42 + 2.6 * s**1.798 + 2.5 * s**1.31 + 1.5
PLANTS = [PODLUBNY, FURNACE, (-2 * s**0.63 + 4) / THIRD_DENOMINATOR]

order = st.integers(0, 30).map(lambda tenths: tenths / 10)
size = st.floats(0.1, 10)
coefficient = st.builds(lambda x, up: x if up else -x, size, st.booleans())
polynomial = st.lists(st.tuples(order, coefficient), min_size=1, max_size=3)
system = st.builds(FractionalTransferFunction.of, polynomial.filter(lambda terms: FractionalPolynomial.of(terms).terms),
                   polynomial.filter(lambda terms: FractionalPolynomial.of(terms).terms))  # fmt: skip
AT = 1j * np.geomspace(0.1, 10, 7)


def near(found, wanted, cancelled):
    """To 1e-9 of what was summed up, and only where no denominator vanishes."""
    assert np.abs(found - wanted) == pytest.approx(np.zeros(len(AT)), abs=1e-9 * float(np.max(cancelled)))


# --- arithmetic


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


# --- stability


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


# --- H2 norm


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


# --- over time


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
    """Any orders: two ways that share nothing but the transform."""
    g = FractionalTransferFunction.of([(0, 1.0)], [*terms, (0, constant)])
    assume(np.diff(g.denominator.orders).min() > 0.01)
    assert g.stability()
    found = g.step(np.array([t]))[0]
    assert found == pytest.approx(along_a_line(lambda at: g(at) / at, t), rel=1e-5, abs=1e-6 / constant)


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


# --- state spaces


@pytest.mark.parametrize("plant", [PODLUBNY, *PLANTS[2:], 2 / (s**0.5 * (s + 3)), (1 + s**0.5) / (2 + s**0.5)])
def test_a_realisation_is_the_system_over_its_band_and_says_how_far_it_is_off(plant):
    f = np.geomspace(0.01, 10, 77)
    for space, gain, phase in ((plant.oustaloup(0.01, 10), 0.5, 5.0), (plant.least_squares(0.01, 10, 8), 0.03, 0.3)):
        assert space.gain_error < gain
        assert space.phase_error < phase
        ratio = space.system(2j * np.pi * f) / plant.response(f)
        assert 20 * np.abs(np.log10(np.abs(ratio))).max() < 1.1 * space.gain_error
        assert np.real(space.system.poles()).max() < 1e-9
        assert f"within {space.gain_error:.2g} dB" in repr(space)
        as_control = space.to_control()
        assert as_control(2j) == pytest.approx(space.system(2j))
        assert [panel.y_label for panel in space.figure().panels][2:] == ["gain error [dB]", "phase error [deg]"]


def test_oustaloups_realisation_keeps_the_gain_at_rest_and_the_step():
    space = PODLUBNY.oustaloup(1e-3, 100).system
    assert space(0.0) == pytest.approx(1.0)
    t = np.linspace(0, 20, 200)
    found = control.step_response(space.to_control(), t).outputs
    assert found == pytest.approx(PODLUBNY.step(t), abs=0.02)


@pytest.mark.parametrize("direct", [True, False])
def test_whole_orders_are_realised_exactly(direct):
    g = ((s**2 if direct else 1) + 0.3) / (s**2 + 0.2 * s + 1)
    for space in (g.oustaloup(0.01, 1), g.least_squares(0.01, 1, 2)):
        assert len(space.system.A) == 2
        assert space.gain_error < 1e-6


def test_more_states_are_nearer():
    errors = [PODLUBNY.least_squares(0.01, 10, states).gain_error for states in (3, 5, 7, 9)]
    assert errors == sorted(errors, reverse=True)


# --- fit


@pytest.mark.parametrize(
    ("g", "zeros", "poles"),
    [
        (3 / s**0.7, 0, 1),
        (5 / (2 * s**1.5 + 1), 0, 1),
        ((s**0.6 + 2) / (s**1.2 + 3 * s**0.6 + 1), 1, 2),
        (1 / (0.5 * s**1.8 + 0.1 * s**0.9 + 1), 0, 2),
    ],
)
def test_a_fit_finds_order_and_coefficients(g, zeros, poles):
    f = np.geomspace(0.02, 5, 40)
    found = wb.fit_fractional(f, g.response(f), zeros, poles)
    assert found.error < 1e-10
    assert found.system.order == g.order
    assert found.system(AT) == pytest.approx(g(AT), rel=1e-8)
    assert found.figure().panels


def test_a_fit_through_noise_is_as_good_as_the_noise():
    random = np.random.default_rng(3)
    g, f = 1 / (0.5 * s**1.8 + 0.1 * s**0.9 + 1), np.geomspace(0.02, 5, 200)
    noise = 0.02 * (random.standard_normal(200) + 1j * random.standard_normal(200)) / sqrt(2)
    found = wb.fit_fractional(f, g.response(f) * (1 + noise), 0, 2)
    assert found.error == pytest.approx(0.02, rel=0.2)
    assert float(found.system.order) == pytest.approx(0.9, abs=0.005)


def test_orders_with_nothing_in_common_are_fitted():
    """Podlubny's plant from a commensurate fit of it, which is 4 % off: orders 2.2 and 0.9 again."""
    f = np.geomspace(0.01, 10, 60)
    start = wb.fit_fractional(f, PODLUBNY.response(f), 0, 2)
    assert start.error > 0.03
    found = fit_orders(f, PODLUBNY.response(f), start.system)
    assert found.error < 1e-9
    assert [order for order, _ in found.system.denominator.terms] == [0, Fraction(9, 10), Fraction(11, 5)]
    with pytest.raises(InputError, match="2 frequencies for 3 coefficients and 2 orders; measure more"):
        fit_orders(f[:2], PODLUBNY.response(f[:2]), start.system)


def test_a_numpy_number_is_a_number():
    assert (np.float64(2) * PODLUBNY)(AT) == pytest.approx(2 * PODLUBNY(AT))
    assert (np.float64(2) + PODLUBNY)(AT) == pytest.approx(2 + PODLUBNY(AT))
    assert [panel.y_label for panel in PODLUBNY.bode(0.01, 10).panels] == ["gain [dB]", "phase [deg]"]


def test_a_sheet_is_fitted(tmp_path):
    f = np.geomspace(0.1, 30, 40)
    response = (4 / (s**0.8 + 20)).response(f)
    rows = np.column_stack((f, 20 * np.log10(np.abs(response)), np.degrees(np.angle(response))))
    lines = ["frequency [Hz],gain [dB],phase [deg]", *(",".join(f"{x:.12g}" for x in row) for row in rows)]
    path = tmp_path / "measured.csv"
    path.write_text("\n".join(lines))
    sheet = wb.read_sheet(path, 0.1, "command", "position")
    found = wb.fit_fractional(sheet.f, sheet.response, 0, 1, relative=sheet.relative)
    assert found.system.order == Fraction(4, 5)
    assert np.angle(found.response / response) == pytest.approx(np.zeros(40), abs=1e-5)
    ratio = found.system.response(f) / response
    assert ratio == pytest.approx(np.full(40, ratio[0]), rel=1e-6)


@pytest.mark.parametrize(
    ("f", "response", "zeros", "poles", "message"),
    [
        ([1.0, 2.0], [1.0, 0.5], 0, 4, "2 frequencies and 2 responses for 5 coefficients"),
        ([1.0, 2.0, 3.0], [1.0, 0.0, 1.0], 0, 1, "responses finite and not 0"),
        ([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], 2, 1, "at least as many poles as zeros"),
    ],
)
def test_a_fit_that_cannot_be_is_refused(f, response, zeros, poles, message):
    with pytest.raises(InputError, match=message):
        wb.fit_fractional(np.array(f), np.array(response), zeros, poles)
