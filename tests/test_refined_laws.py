"""What refinements do, as formulas and as physics, whatever their numbers."""

import casadi as ca
import numpy as np
import pytest
from effect_laws import BETA, EPS, TRAVEL, evaluated
from hypothesis import given, settings, strategies as st

from workbench.plant.effects import Scope, find, refine
from workbench.plant.effects.curves import areas, knots_at, levels, ramps
from workbench.plant.effects.natural import variable

FEW = settings(max_examples=25)


def test_strengths_differ_with_the_sign():
    refined = refine(find("jack.friction", "coulomb"), "sign of velocity")
    forces = [
        evaluated(refined, "friction", 0.0, {"Fc": 1000.0, "Fc_sign_velocity": 0.2}, velocity=v, position=0.0, drop=0.0)
        for v in (0.1, -0.1)
    ]
    assert [force for (force,), _ in forces] == pytest.approx([1200.0, -800.0])


def test_strengths_depend_on_a_place_and_stay_positive():
    refined = refine(find("jack.friction", "coulomb"), "over position", (0.0, 0.1))

    def force(x, k):
        numbers = {"Fc": 1000.0, "Fc_over_position": k}
        return evaluated(refined, "friction", 0.0, numbers, velocity=0.1, position=x, drop=0.0)[0][0]

    assert [force(x, 0.5) for x in (-0.1, 0.0, 0.1)] == pytest.approx([500.0, 1000.0, 1500.0])
    assert [force(x, 0.9) for x in (-1.0, 1.0)] == pytest.approx([100.0, 3000.0])


def test_a_modulated_number_stays_in_its_range():
    refined = refine(find("load.compliance", "load"), "sign of acceleration")
    assert np.isfinite(evaluated(refined, "acceleration", 5.0, {"mu": 0.9, "mu_sign_acceleration": 0.9})[0]).all()


@FEW
@given(places=st.lists(st.floats(-1, 1), min_size=3, max_size=8, unique=True), at=st.floats(-2, 2))
def test_levels_are_positive_and_sum_to_one_and_ramps_rise(places, at):
    position = variable(find("load.spring", ""), "position")
    knots = knots_at(position, places, len(places))
    assert min(np.diff(knots)) > 0
    q = ca.SX.sym("q")
    symbols = [ca.SX(knot) for knot in knots]
    level, ramp, area = (ca.vertcat(*basis(q, symbols)) for basis in (levels, ramps, areas))
    curve = ca.Function("curve", [q], [level, ca.jacobian(ramp, q), area, ca.jacobian(area, q)])
    heights, rises, areas_, slopes = (np.array(part).ravel() for part in curve(at))
    assert heights.min() > -1e-12
    assert heights.sum() == pytest.approx(1, abs=1e-9)
    assert rises.min() >= 0
    assert areas_.sum() == pytest.approx(at, abs=1e-9)
    assert slopes.min() >= 0
    assert slopes.sum() == pytest.approx(1, abs=1e-9)
    assert np.abs(np.array(curve(0)[2])).max() < 1e-12


def random_numbers(effect, draw):
    """Any numbers that a fit may choose."""
    return {n.name: draw.draw(st.floats(n.low, n.high)) for n in effect.numbers if not n.given}


@FEW
@given(draw=st.data(), v=st.floats(-1, 1))
@pytest.mark.parametrize("words", ["sign of velocity", "over drop", "spline 6 in velocity", "spline 4 in |position|"])
def test_friction_takes_energy_whatever_the_numbers(words, draw, v):
    refined = refine(find("jack.friction", "coulomb"), words)
    numbers = random_numbers(refined, draw)
    place = {"position": draw.draw(st.floats(-0.5, 0.5)), "drop": draw.draw(st.floats(-2e7, 2e7))}
    ((force,), _) = evaluated(refined, "friction", 0.0, numbers, velocity=v, **place)
    assert force * v >= 0


@FEW
@given(draw=st.data(), p=st.floats(1e5, 3e7), more=st.floats(1e3, 1e7))
def test_a_bent_modulus_is_positive_and_rises_with_pressure(draw, p, more):
    refined = refine(find("oil.air", "isothermal"), "spline 5 in pressure")
    numbers = random_numbers(refined, draw)
    (low,), (high,) = (evaluated(refined, "modulus", BETA, numbers, pressure=q)[0] for q in (p, p + more))
    assert 0 < low <= high * (1 + 1e-12)


@FEW
@given(draw=st.data(), z=st.floats(-TRAVEL, TRAVEL), more=st.floats(1e-7, 1e-3))
@pytest.mark.parametrize("word", ["opening", "|opening|"])
def test_bent_openings_rise_and_stay_positive(word, draw, z, more):
    refined = refine(find("main.deadband", "lap"), f"spline 5 in {word}")
    numbers = random_numbers(refined, draw)

    def openings(at):
        return evaluated(refined, "main_openings", (0.0, 0.0), numbers, spool=at, lap=EPS, travel=TRAVEL)[0]

    here, further = openings(z), openings(z + more)
    assert min(here) > 0
    assert further[0] >= here[0]
    assert further[1] <= here[1]
    if word == "|opening|":
        assert here == pytest.approx(openings(-z)[::-1], rel=1e-12)


def responses(words, numbers, w):
    """The response of a refined constant force through its filter at angular frequency w, against the plain one."""
    refined = refine(find("load.bias", "weight"), words)
    names = [state.name for state in refined.states]
    x, f = ca.SX.sym("x", len(names)), ca.SX.sym("f")
    rates: dict[str, ca.SX] = {}
    values = {refined.key(n.name): ca.SX(n.typical) for n in refined.numbers}
    values |= {refined.key(name): ca.SX(value) for name, value in numbers.items()} | {refined.key("F"): f}
    scope = Scope(refined, values, {refined.key(n): x[i] for i, n in enumerate(names)}, {}, rates, {})
    y = refined.laws["body_force"](ca.SX(0), scope)
    rate = ca.vertcat(*(rates[refined.key(n)] for n in names))
    parts = [ca.jacobian(of, by) for of in (rate, y) for by in (x, f)]
    a, b, c, d = (np.array(part) for part in ca.Function("lin", [x, f], parts)(np.zeros(len(names)), 0.0))
    return (c @ np.linalg.solve(1j * w * np.eye(len(names)) - a, b) + d).item()


def test_linear_elements_are_what_their_formulas_say():
    w = 2 * np.pi * 20
    s = 1j * w
    fast = 1e-5
    assert responses("pole", {"pole_tau": 5e-3}, w) == pytest.approx((1 + fast * s) / (1 + (5e-3 + fast) * s))
    length = 5e-3 + fast
    expected = (1 + 2 * 0.3 * fast * s + fast * fast * s * s) / (1 + 2 * 0.3 * length * s + (length * s) ** 2)
    assert responses("resonance", {"resonance_tau": 5e-3}, w) == pytest.approx(expected)
    numbers = {"linear_gain1": 0.5, "linear_T1": 2e-3, "linear_gain2": -0.3, "linear_T2": 0.05}
    expected = 1 + 0.5 / (1 + 2e-3 * s) - 0.3 / (1 + 0.05 * s)
    assert responses("linear 2", numbers, w) == pytest.approx(expected)
    w0 = 2 * np.pi * 30
    below = 1 + 2 * 0.1 * s / w0 + (s / w0) ** 2
    numbers = {"pair_gain1": 0.4, "pair_gain2": 0.2, "pair_f": 30.0, "pair_zeta": 0.1}
    assert responses("linear pair", numbers, w) == pytest.approx(1 + (0.4 + 0.2 * s / w0) / below)
