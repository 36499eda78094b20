"""Effects: none changes nothing, friction opposes and dissipates as its formula says, mistakes are named."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.base.errors import InputError
from workbench.base.units import to_si
from workbench.engine import Engine
from workbench.linear import equilibrium, linearise
from workbench.plant import build
from workbench.plant.effects import LIBRARY, applies, find, resolve
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

CREEP = 2e-3  # m/s, of the docstrings
FORMULAS = ("coulomb", "stribeck", "lugre")


@pytest.fixture(scope="module")
def rubbing(with_effect):
    """The plant with jack.friction by a formula, at its typical numbers."""
    return {formula: build(with_effect("jack.friction", formula)) for formula in FORMULAS}


def friction(plain, plant, x, z=0.0):
    """Friction force [N] at states x of the plain plant: the mass's missing acceleration; and the rates there."""
    whole = np.array([x[plain.state(s.name)] if s.name in [p.name for p in plain.states] else z for s in plant.states])
    u = np.zeros(len(plain.inputs))
    with_it = np.array(plant.f(whole, u, plant.p)).ravel()
    without = np.array(plain.f(x, u, plain.p)).ravel()
    mass = plain.p[plain.parameters.index("M")]
    return mass * (without[plain.state("v")] - with_it[plant.state("v")]), with_it


def at_speed(plain, v):
    x = plain.start
    x[plain.state("v")] = v
    return x


def typical(plant, name):
    return plant.p[plant.parameters.index(f"jack.friction.{name}")]


def stribeck_level(plant, v):
    fc, vs = typical(plant, "Fc"), typical(plant, "vs")
    fs = fc * typical(plant, "ratio") if "jack.friction.ratio" in plant.parameters else typical(plant, "Fs")
    return fc + (fs - fc) * np.exp(-((v / vs) ** 2))


def test_no_effect_is_the_plain_plant(rig, plant, rest, engine, commanded):
    same = build(replace(rig, effects=()))
    for attribute in ("states", "inputs", "outputs", "parameters", "dry_friction"):
        assert getattr(same, attribute) == getattr(plant, attribute)
    t = np.arange(51) * 1e-3
    u = commanded(0.3 * np.sin(60 * t))
    assert np.array_equal(Engine(same).run(rest.x, t, u).x, engine.run(rest.x, t, u).x)


@pytest.mark.parametrize("formula", ["coulomb", "stribeck"])
def test_friction_of_zero_is_no_friction(with_effect, engine, rest, commanded, formula):
    zero = {"Fc": (0.0, "N"), "Fs": (0.0, "N")} if formula == "stribeck" else {"Fc": (0.0, "N")}
    t = np.arange(51) * 1e-3
    u = commanded(0.3 * np.sin(60 * t))
    got = Engine(build(with_effect("jack.friction", formula, **zero))).run(rest.x, t, u)
    assert np.allclose(got.x, engine.run(rest.x, t, u).x, rtol=0, atol=1e-9 * engine.plant.scale)


@given(v=st.floats(-1, 1))
def test_coulomb_and_stribeck_are_their_docstrings(plant, rubbing, v):
    for formula, level in (("coulomb", 800.0), ("stribeck", stribeck_level(rubbing["stribeck"], v))):
        force, _ = friction(plant, rubbing[formula], at_speed(plant, v))
        assert force == pytest.approx(level * np.tanh(v / CREEP), abs=1e-6)
        assert force * v >= 0


@given(v=st.floats(-1, 1), z=st.floats(-2, 2))
def test_lugre_is_the_published_one_with_its_bristle_measured_in_d(plant, rubbing, v, z):
    """z' = v - sigma0 |v| z/g, F = sigma0 z + sigma1 z' with sigma0 = Fc/d, sigma1 = Fc td/d, z in units of d."""
    lugre = rubbing["lugre"]
    d, td, fc = (typical(lugre, name) for name in ("d", "td", "Fc"))
    rate = v - fc / d * abs(v) * (z * d) / stribeck_level(lugre, v)
    force, rates = friction(plant, lugre, at_speed(plant, v), z)
    assert rates[lugre.state("jack.friction.z")] == pytest.approx(rate / d, rel=1e-9, abs=1e-9)
    assert force == pytest.approx(fc / d * (z * d) + fc * td / d * rate, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("v", [-0.5, -0.02, -3e-3, 3e-3, 0.01, 0.05, 1.0])
def test_steady_sliding_is_the_stribeck_curve(plant, rubbing, v):
    """At constant speed the LuGre bristle rests where its force is the Stribeck level, against the motion."""
    lugre = rubbing["lugre"]
    z = np.sign(v) * stribeck_level(lugre, v) / typical(lugre, "Fc")
    force, rates = friction(plant, lugre, at_speed(plant, v), z)
    assert rates[lugre.state("jack.friction.z")] == pytest.approx(0, abs=1e-12)
    assert force == pytest.approx(np.sign(v) * stribeck_level(rubbing["stribeck"], v), rel=1e-9)
    if abs(v) > 0.005:
        flat, _ = friction(plant, rubbing["stribeck"], at_speed(plant, v))
        assert force == pytest.approx(flat, rel=0.02)


@pytest.mark.parametrize("formula", FORMULAS)
@pytest.mark.parametrize("speed", [0.01, 0.1, -0.1])
def test_a_moving_jack_needs_the_pressure_that_friction_takes(rig, rubbing, formula, speed):
    plant = rubbing[formula]
    point = equilibrium(plant, speed=speed)
    level = stribeck_level(plant, speed) if formula != "coulomb" else typical(plant, "Fc")
    p1, p2 = (point.x[plant.state(name)] for name in ("P1", "P2"))
    assert (p1 - p2) * rig["Aj"] == pytest.approx(np.sign(speed) * level + rig["b"] * speed, rel=1e-3)


@pytest.mark.parametrize("formula", FORMULAS)
def test_friction_dissipates(plant, rubbing, rest, formula):
    """Coasting with the ports shut: with friction the jack comes to rest sooner, and never gains energy by it."""
    rough = rubbing[formula]
    t = np.arange(401) * 5e-4
    runs = {}
    for each in (plant, rough):
        start = equilibrium(each).x
        start[each.state("v")] = 0.3
        p = each.parameter_values(K3=0.0, Cl=0.0, b=0.0)
        runs[each] = Engine(each).run(start, t, np.zeros((401, len(each.inputs))), p)
    v = runs[rough].x[:, rough.state("v")]
    z = runs[rough].x[:, rough.state("jack.friction.z")] if formula == "lugre" else np.zeros(401)
    states = [at_speed(plant, speed) for speed in v]
    force = np.array([friction(plant, rough, x, bristle)[0] for x, bristle in zip(states, z, strict=True)])
    assert np.trapezoid(force * v, t) > 0
    assert np.abs(v[-80:]).max() < 0.8 * np.abs(runs[plant].x[-80:, plant.state("v")]).max()


def test_break_away_needs_more_than_sliding(rubbing):
    """Pulled by a slowly growing force, the jack holds up to the static level and then runs: LuGre sticks."""
    plant = rubbing["lugre"]
    start, t = equilibrium(plant).x, np.arange(1201) * 1e-3
    p = plant.parameter_values(K3=0.0, Cl=1e-7)  # the chambers joined: friction alone holds
    u = np.zeros((1201, len(plant.inputs)))
    u[:, plant.input("disturbance")] = -1600 * t
    run = Engine(plant).run(start, t, u, p)
    v = run.x[:, plant.state("v")]
    assert run.ok
    assert np.abs(v[t < 0.6]).max() < 1e-3
    away = 1600 * t[np.argmax(np.abs(v) > 0.01)]
    assert typical(plant, "Fc") < away < 1.25 * typical(plant, "Fc") * typical(plant, "ratio")


def test_a_linearisation_takes_dry_friction_for_damping(plant, with_effect):
    """tanh(v/v0) looks like Fc/v0 of viscous friction: 40 N make 0.02 of damping into a false 0.078."""
    rough = build(with_effect("jack.friction", "coulomb", Fc=(40.0, "N")))
    false, true = damping(rough, rough.p), damping(rough, rough.without_dry_friction())
    assert false == pytest.approx(0.078, abs=1e-3)
    assert true == pytest.approx(0.020, abs=5e-4)
    assert true == pytest.approx(damping(plant, plant.p), rel=1e-9)


def damping(plant, p):
    poles = linearise(plant, equilibrium(plant, p=p), p=p).poles()
    (pole,) = (pole for pole in poles if pole.imag > 0 and 20 < abs(pole) / (2 * np.pi) < 40)
    return -pole.real / abs(pole)


@pytest.mark.parametrize("effect", LIBRARY, ids=lambda effect: f"{effect.name}-{effect.formula}")
def test_an_effect_is_documented_and_its_plant_runs(rig, effect):
    assert effect.source
    assert all(law.__doc__ for law in effect.laws.values())
    for number in effect.numbers:
        assert number.low <= number.typical <= number.high
        assert number.meaning
        to_si(1.0, number.shown, number.si)
    rig = rig if applies(effect, rig) else load_rig("festo-tp511")
    plant = build(replace(rig, effects=(EffectUse(effect.name, effect.formula, {}),)))
    assert {effect.key(number.name) for number in effect.numbers} <= set(plant.parameters)
    there = {"", *(f"sensor_{name}" for name in plant.outputs)}
    assert {effect.key(s.name) for s in effect.states if s.of in there} <= {state.name for state in plant.states}
    start = equilibrium(plant)
    u = np.zeros((101, len(plant.inputs)))
    u[:, 0] = np.where(np.arange(101) < 50, 0.1, -0.1)
    assert Engine(plant).run(start.x, np.arange(101) * 1e-3, u).ok


def test_names_and_formulas_are_unique():
    assert len({(effect.name, effect.formula) for effect in LIBRARY}) == len(LIBRARY)
    assert find("jack.friction", "") is find("jack.friction", "coulomb")


@pytest.mark.parametrize(
    ("name", "formula", "numbers", "message"),
    [
        ("jack.fricton", "", {}, 'no effect "jack.fricton"; did you mean "jack.friction"?'),
        ("jack.friction", "strybeck", {}, 'jack.friction: no formula "strybeck"; did you mean "stribeck"?'),
        ("jack.friction", "coulomb", {"Fd": (1.0, "N")}, 'jack.friction: no number "Fd"; did you mean "Fc"?'),
        ("jack.friction", "coulomb", {"Fs": (1.0, "N")}, 'jack.friction: no number "Fs"'),
        ("jack.friction", "coulomb", {"Fc": (1.0, "bar")}, 'jack.friction: Fc: unit "bar" cannot be converted to "N"'),
        ("jack.friction", "coulomb", {"Fc": (-1.0, "N")}, "jack.friction: Fc = -1 N is outside 0 to 20000 N"),
        ("jack.friction", "coulomb", {"Fc": (float("nan"), "N")}, "jack.friction: Fc = nan N is outside"),
    ],
)
def test_a_mistake_in_an_effect_is_named(with_effect, name, formula, numbers, message):
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        build(with_effect(name, formula, **numbers))
    assert "\n" not in str(caught.value)


def test_numbers_come_in_their_unit(with_effect):
    ((_, values),) = resolve(with_effect("jack.friction", "coulomb", Fc=(0.5, "kN")))
    assert values["Fc"] == pytest.approx(500.0)


def test_one_effect_may_be_declared_once(rig):
    twice = (EffectUse("jack.friction", "coulomb", {}), EffectUse("jack.friction", "stribeck", {}))
    with pytest.raises(InputError, match="declared twice"):
        build(replace(rig, effects=twice))
    with pytest.raises(InputError, match=r"jack\.friction would be there twice"):
        build(replace(rig, effects=twice[:1]), also=(find("jack.friction", "stribeck"),))
