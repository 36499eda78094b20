"""What the formulas of the library must do as physics, whatever their numbers."""

import casadi as ca
import numpy as np
import pytest
from effect_laws import BETA, EPS, TRAVEL, evaluated, lap
from hypothesis import given, settings, strategies as st

from workbench.plant.effects import Scope, find
from workbench.rigs.oil import ATMOSPHERE, GAS_CONTENT, VAPOUR_PRESSURE

FEW = settings(max_examples=30)


@pytest.mark.parametrize("name", ["jack.friction", "main.stiction"])
@pytest.mark.parametrize("formula", ["coulomb", "stribeck"])
@FEW
@given(v=st.floats(-1, 1))
def test_friction_opposes_motion(name, formula, v):
    effect = find(name, formula)
    (slot,) = effect.laws
    ((force,), _) = evaluated(effect, slot, 0.0, velocity=v)
    assert force * v >= 0


@FEW
@given(v=st.floats(-1, 1), pa=st.floats(-1e5, 4e7), pb=st.floats(-1e5, 4e7))
@pytest.mark.parametrize("formula", ["pressed by the difference", "pressed by the mean", "by direction"])
def test_friction_takes_energy_whatever_the_pressures_and_the_direction(formula, v, pa, pb):
    effect, pressures = find("jack.friction", formula), {"drop": pa - pb, "mean": (pa + pb) / 2, "feed": 21e6}
    ((force,), _) = evaluated(effect, "friction", 0.0, velocity=v, **pressures)
    assert force * v >= 0
    ((none,), _) = evaluated(
        effect, "friction", 0.0, dict.fromkeys((n.name for n in effect.numbers), 0.0), velocity=v, **pressures
    )
    assert none == 0


@FEW
@given(share=st.floats(-0.1, 0.1), w=st.floats(0, 1))
@pytest.mark.parametrize(
    ("formula", "slot", "low"),
    [("position", "sensor_position", -0.25), ("pressures", "sensor_pa", 0.0), ("force", "sensor_force", -0.25)],
)
def test_a_bent_transducer_is_right_at_both_ends_and_never_turns_back(formula, slot, low, share, w):
    bend, number = find("sensor.bend", formula), "a" if formula == "pressures" else "e"

    def shown(place):
        signal = low + place * (0.25 - low)
        return evaluated(bend, slot, signal, {number: share}, low=low, high=0.25)[0][0] - signal

    assert shown(0.0) == pytest.approx(0, abs=1e-15)
    assert shown(1.0) == pytest.approx(0, abs=1e-15)
    most = 0.25 if formula == "force" else 0.25 - low
    assert abs(shown(w)) <= abs(share) * most * (1 + 1e-9) + 1e-15
    assert shown(0.75 if formula == "force" else 0.5) == pytest.approx(share * most)
    step = 1e-3 * (0.25 - low)
    assert w > 0.999 or shown(w + 1e-3) - shown(w) > -step


@FEW
@given(alpha=st.floats(1e-4, 0.3), p=st.floats(1e3, 4e7), more=st.floats(1.01, 3))
@pytest.mark.parametrize("formula", ["isothermal", "polytropic", "fixed share", "power"])
def test_air_softens_and_pressure_stiffens(formula, alpha, p, more):
    effect = find("oil.air", formula)
    number = effect.numbers[0]

    def modulus(share, pressure):
        return evaluated(effect, "modulus", BETA, {number.name: share}, pressure=pressure)[0][0]

    assert 0 < modulus(alpha, p) < BETA
    assert modulus(alpha * more, p) < modulus(alpha, p) <= modulus(alpha, p * more)
    assert modulus(0.0, p) == pytest.approx(BETA, rel=1e-15)
    assert modulus(alpha, -1e7) == modulus(alpha, 0.0) > 0


@pytest.mark.parametrize("formula", ["play", "prandtl-ishlinskii", "bouc-wen"])
def test_hysteresis_makes_a_loop_as_wide_as_it_says(formula):
    """A slow triangle of 10 mA: the two branches are twice the half-width apart, at any speed, and enclose an area."""
    effect = find("pilot.hysteresis", formula)
    widths = []
    for period in (0.5, 2.0):
        steps = int(period / 1e-5)
        t = np.linspace(0, 2 * period, 2 * steps + 1)
        i = 0.01 * (1 - 4 * np.abs((t / period - 0.25) % 1 - 0.5))
        acting, dt = driven(effect, i, t[1]), slice(steps, None)
        assert abs(np.trapezoid(acting[dt], i[dt])) > 0
        zero = np.flatnonzero(np.diff(np.sign(i[dt])) != 0)
        widths.append(np.ptp(acting[dt][zero]))
    typical = {n.name: n.typical for n in effect.numbers}
    half = typical["r"] if "r" in typical else typical["a"] * typical["width"]
    assert widths == pytest.approx([2 * half] * 2, rel=0.02)


def driven(effect, i, step):
    """The acting current of a law under a current, its states by explicit steps [s]."""
    names = [s.name for s in effect.states]
    current, x, rates = ca.SX.sym("i"), ca.SX.sym("x", len(names)), {}
    p = {effect.key(n.name): ca.SX(n.typical) for n in effect.numbers}
    scope = Scope(effect, p, {effect.key(n): x[k] for k, n in enumerate(names)}, {}, rates, {})
    value = effect.laws["motor_current"](current, scope)
    after = x + step * ca.vertcat(*(rates[effect.key(n)] for n in names))
    walk = ca.Function("walk", [x, current], [after, value]).mapaccum(len(i))
    return np.array(walk(np.zeros(len(names)), i[None])[1]).ravel()


@pytest.mark.parametrize("formula", ["lap", "linear", "smooth"])
@FEW
@given(overlap=st.floats(0, 0.3), z=st.floats(-TRAVEL, TRAVEL))
def test_a_dead_band_takes_flow_away_but_never_all_of_the_leak(formula, overlap, z):
    effect = find("main.deadband", formula)

    def openings(at):
        p, context = {"overlap": overlap}, {"spool": at, "lap": EPS, "travel": TRAVEL}
        return np.array(evaluated(effect, "main_openings", (0.0, 0.0), p, **context)[0])

    here, further, null = openings(z), openings(z + 1e-6), openings(0.0)
    assert further[0] >= here[0] > 0
    assert here[0] == pytest.approx(openings(-z)[1], rel=1e-12)
    assert here[0] <= max(lap(z), EPS) * (1 + 1e-9)
    assert 0.005 * EPS < null[0] <= EPS * (1 + 1e-9)
    assert here[0] == pytest.approx(max(z - overlap * TRAVEL, 0), abs=2 * EPS + 0.011 * overlap * TRAVEL)


def test_passages_as_wide_as_the_lands_take_the_root_of_a_half():
    """Two orifices of one area in series have that area over the root of 2."""
    got, _ = evaluated(
        find("main.deadband", "lap, narrow passages"),
        "main_openings",
        (0.0, 0.0),
        {"overlap": 0.0, "c": 1.0},
        spool=TRAVEL - EPS,
        lap=EPS,
        travel=TRAVEL,
    )
    assert got[0] == pytest.approx(TRAVEL / np.sqrt(2), rel=1e-9)


def test_the_curve_leaves_the_flow_at_full_travel():
    effect = find("main.asymmetry", "curve")
    p = {"c_extend": 0.6, "c_retract": -0.6}
    for part, gains in ((1.0, (1, 1)), (1e-6, (1.6, 0.4))):
        opening = part * TRAVEL
        got, _ = evaluated(effect, "main_openings", (opening, opening), p, travel=TRAVEL)
        assert np.array(got) / opening == pytest.approx(gains, rel=1e-5)


@FEW
@given(a=st.floats(-50, 50), mu=st.floats(0, 0.9), y=st.floats(-1e-3, 1e-3), vy=st.floats(-1, 1))
def test_a_hanging_load_takes_no_momentum_from_nowhere(a, mu, y, vy):
    """Both masses together answer the force as one: (1 - mu) a1 + mu a2 = F/M."""
    (on_rod,), rates = evaluated(find("load.compliance", "load"), "acceleration", a, {"mu": mu}, {"y": y, "vy": vy})
    assert (1 - mu) * on_rod + mu * (on_rod + rates["vy"]) == pytest.approx(a, rel=1e-9, abs=1e-6)


@FEW
@given(force=st.floats(-1e5, 1e5), c=st.floats(0, 1e-6))
def test_a_mount_gives_by_its_compliance(force, c):
    """At rest where the spring carries the force: y = -c F."""
    numbers, states = {"c": c}, {"y": -c * force}
    _, rates = evaluated(find("load.compliance", "mount"), "acceleration", 0.0, numbers, states, rod_force=force)
    assert rates == {"y": 0.0, "vy": pytest.approx(0.0, abs=1e-6)}
    motion, _ = evaluated(find("load.compliance", "mount"), "piston", (0.1, 0.2), numbers, {"y": 0.01, "vy": 0.05})
    assert motion == pytest.approx([0.09, 0.15])


OIL = {"saturation": ATMOSPHERE, "vapour": VAPOUR_PRESSURE, "gas": GAS_CONTENT, "beta": BETA}
LINE = OIL | {"volume": 1e-3, "rated": 1e-3, "feed": 2e7, "room_a": 1.0, "room_b": 1.0}


def test_no_two_hoses_swing_alike():
    """The pressures of a line swing by what its flow accelerates, less in a larger one: a fit must not find a share of
    a small line in place of a large one."""
    hose, context, still = find("line.hose", "lumped"), {**LINE, "pa": 5e6, "pb": 5e6}, (5e6, 5e6)
    swings = []
    for r in (1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5, 3.0):
        _, rates = evaluated(hose, "line_flows", (0.0, 0.0), {"r": r}, {"PA": 6e6}, **context)
        (seen, _), _ = evaluated(hose, "ports", still, {"r": r}, {"PA": 6e6}, **OIL)
        swings.append((seen - still[0]) / rates["qA"])
    assert np.all(np.diff(swings) <= 1e-3 * swings[0])
    assert np.all(np.diff(swings[3:]) < 0)


@FEW
@given(r=st.floats(0.02, 3), f=st.floats(5, 1000), zeta=st.floats(0.02, 0.9))
def test_a_hose_keeps_its_oil_and_swings_at_f(r, f, zeta):
    """What the valve gives less what the chamber gets is what pressure stores; with the valve shut it swings at f."""
    hose, context, stored = find("line.hose", "lumped"), {**LINE, "pa": 5e6, "pb": 5e6}, r * 1e-3 / BETA

    def moved(**x):
        passed, rates = evaluated(hose, "line_flows", (2e-4, 1e-4), {"r": r, "f": f, "zeta": zeta}, x, **context)
        return passed, rates

    passed, rates = moved(PA=6e6, PB=4e6, qA=3e-4, qB=2e-4)
    assert stored * rates["PA"] == pytest.approx(2e-4 - passed[0], rel=1e-6)
    assert stored * rates["PB"] == pytest.approx(passed[1] - 1e-4, rel=1e-6)
    names = ("PA", "qA")
    filled = {"PA": 5e6, "PB": 5e6}
    still = moved(**filled)[1]
    columns = [
        [moved(**filled | {name: filled.get(name, 0.0) + 1.0})[1][row] - still[row] for name in names] for row in names
    ]
    poles = np.linalg.eigvals(np.array(columns))
    assert np.abs(poles) == pytest.approx([2 * np.pi * f] * 2, rel=1e-3)
    assert -poles.real == pytest.approx([2 * np.pi * f * zeta] * 2, rel=1e-2)
