"""Refinements of effects: off they are the plain formula, their text is all of them, and they act in any plant."""

from dataclasses import replace

import numpy as np
import pytest
from refined_plants import differences, graph_of

from workbench.base.errors import InputError
from workbench.engine import Engine
from workbench.engine.emit import first_unsupported
from workbench.linear import equilibrium, linearise
from workbench.plant import build
from workbench.plant.effects import (
    LIBRARY,
    SLOTS,
    FormulaShape,
    applies,
    find,
    formula_shape,
    load_effects,
    refine,
    refine_at,
    refinements,
    start_from,
)
from workbench.plant.effects.curves import knots_at
from workbench.plant.effects.natural import PASSAGES, variable, variables
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, rig_text

CASES = (
    ("drive.lag", "amplifier", "pole"),
    ("drive.corrector", "pi", "linear 2"),
    ("drive.saturation", "rapp", "sign of current"),
    ("pilot.hysteresis", "bouc-wen", "spline 5 in current"),
    ("main.stiction", "stribeck", "over |spool_velocity|"),
    ("main.deadband", "lap", "sign of opening"),
    ("main.deadband", "lap, narrow passages", "spline 7 in opening"),
    ("main.asymmetry", "edges", "over |opening|"),
    ("supply.sag", "laminar", "over draw"),
    ("supply.sag", "orifice", "resonance"),
    ("oil.air", "power", "spline 5 in pressure"),
    ("jack.external_leakage", "laminar", "spline 4 in drop"),
    ("jack.friction", "stribeck", "sign of velocity"),
    ("jack.friction", "lugre", "over position"),
    ("jack.friction", "coulomb", "spline 5 in |velocity|"),
    ("load.spring", "linear", "linear pair"),
    ("load.compliance", "mount", "pole"),
    ("sensor.lag", "first order", "apart"),
    ("sensor.lag", "first order", "resonance"),
    ("sensor.lag", "line", "offset"),
)
by_case = pytest.mark.parametrize(("name", "formula", "words"), CASES, ids=[f"{n} {f}; {w}" for n, f, w in CASES])


def test_every_slot_is_known_to_refinements():
    assert PASSAGES.keys() == SLOTS.keys()


@by_case
def test_off_is_the_plain_formula_and_typical_is_not(rig, name, formula, words):
    plain = find(name, formula)
    off, typical = differences(rig, refine(plain, words), (plain,))
    assert off < 1e-9
    assert typical > 1e-6


@by_case
def test_the_text_of_a_formula_is_all_of_a_refinement(rig, name, formula, words, tmp_path):
    """Written to a rig file and read again it is the same plant to the last bit."""
    refined = refine(find(name, formula), words)
    numbers = {n.name: Number(n.name, n.typical, n.si, n.si, "") for n in refined.numbers}
    declared = replace(rig, effects=(EffectUse(name, refined.formula, numbers),))
    (tmp_path / "rig.toml").write_text(rig_text(declared), encoding="utf-8")
    plants = [build(declared), build(load_rig(tmp_path / "rig.toml")), build(rig, also=(refined,))]
    x, u = plants[0].start + 0.1 * plants[0].scale, 0.1 * np.ones(len(plants[0].inputs))
    rates = [np.array(plant.f(x, u, plant.p)) for plant in plants]
    assert all(plant.parameters == plants[0].parameters for plant in plants)
    assert all(np.array_equal(plant.p, plants[0].p) for plant in plants)
    assert all(np.array_equal(rate, rates[0]) for rate in rates)


@by_case
def test_it_runs_compiled_and_its_slopes_exist(rig, name, formula, words):
    plant = build(rig, also=(refine(find(name, formula), words),))
    graph = graph_of(plant)
    assert first_unsupported(graph) is None
    rest = equilibrium(plant)
    t = np.arange(41) * 1e-3
    u = np.zeros((41, len(plant.inputs)))
    u[:, 0] = 0.2
    run = Engine(plant, back_end="interpreted").run(rest.x, t, u)
    assert run.ok
    assert all(np.isfinite(np.array(part)).all() for part in graph(run.x[-1], u[0], plant.p))
    assert np.isfinite(linearise(plant, rest).poles()).all()


def test_refinements_follow_one_another(rig):
    refined = find("jack.friction", "stribeck; sign of velocity; over |position|; pole")
    assert refined.formula == "stribeck; sign of velocity; over |position|; pole"
    names = [n.name for n in refined.numbers]
    assert names[3:7] == ["Fc_sign_velocity", "Fs_sign_velocity", "Fc_over_abs_position", "Fs_over_abs_position"]
    assert [n.name for n in refined.fitted][-1] == "pole_tau"
    assert [s.name for s in refined.states] == ["pole_friction1"]
    assert differences(rig, refined, (find("jack.friction", "stribeck"),))[0] < 1e-9
    assert find("jack.friction", "; pole").formula == "coulomb; pole"


REFUSED = (
    ("stribeck; sgn of velocity", 'no refinement "sgn of velocity"; write one like "sign of velocity"'),
    ("stribeck; sign of pressure", 'nothing there depends on "pressure"; known: drop, position, velocity'),
    ("stribeck; sign of |velocity|", '"|velocity|" has no sign'),
    ("stribeck; pole; pole", "pole_tau is there twice"),
    ("stribeck; spline 2 in velocity", "a spline has 3 to 15 knots, not 2"),
    ("stribeck; linear 4", 'linear 4": give it 1 to 3 poles'),
    ("stribeck;", 'no refinement ""'),
    ("striebeck; pole", 'no formula "striebeck"; did you mean "stribeck"?'),
)


@pytest.mark.parametrize(("formula", "message"), REFUSED, ids=[formula for formula, _ in REFUSED])
def test_what_cannot_be_is_told_in_a_line(formula, message):
    with pytest.raises(InputError) as caught:
        find("jack.friction", formula)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_an_effect_cannot_take_is_refused():
    with pytest.raises(InputError, match=r'it has no law in the plant that "pole" could refine'):
        refine(find("drive.delay", "shift"), "pole")
    with pytest.raises(InputError, match=r"slot modulus is passed twice"):
        refine(find("oil.air", "power"), "pole")
    with pytest.raises(InputError, match=r'write "pressure" without bars'):
        refine(find("oil.air", "power"), "over |pressure|")
    with pytest.raises(InputError, match=r"a spline of 5 knots, and 2 places"):
        refine(find("jack.friction", ""), "spline 5 in velocity", (0.0, 1.0))


def test_knots_that_do_not_rise_are_refused(rig):
    numbers = {"velocity_knot2": Number("velocity_knot2", -2.0, "m/s", "m/s", "")}
    declared = replace(rig, effects=(EffectUse("jack.friction", "coulomb; spline 3 in velocity", numbers),))
    with pytest.raises(InputError, match=r"jack\.friction: velocity_knot2 must lie above the knot before it"):
        build(declared)


@pytest.mark.parametrize("effect", LIBRARY, ids=lambda effect: effect.title)
def test_what_is_offered_is_cheapest_first_and_does_something(effect, rig):
    offered, rig = refinements(effect), rig if applies(effect, rig) else load_rig("festo-tp511")
    assert bool(offered) == bool(effect.laws)
    counts = [len(refined.fitted) for refined in offered]
    assert counts == sorted(counts)
    assert all(refined.name == effect.name and applies(refined, rig) for refined in offered)
    assert all(find(refined.name, refined.formula).formula == refined.formula for refined in offered)
    assert len({refined.formula for refined in offered}) == len(offered)


def test_places_are_where_the_samples_are():
    samples = {"velocity": np.linspace(-0.2, 0.1, 301), "position": np.zeros(9)}
    offered = {e.formula: e for e in refinements(find("jack.friction", ""), samples)}
    assert not any("position" in formula for formula in offered)
    assert "coulomb; over drop" in offered
    velocity = variable(find("jack.friction", ""), "velocity")
    places = [n.typical for n in offered["coulomb; spline 5 in |velocity|"].numbers if n.given]
    assert places == knots_at(velocity.magnitude, samples["velocity"], 5)
    assert places[0] == 0
    middle, half = (n.typical for n in offered["coulomb; over velocity"].numbers if n.given)
    assert (middle, half) == pytest.approx((-0.05, 0.15))
    again = refine_at(find("jack.friction", ""), "spline 5 in |velocity|", samples)
    assert again.numbers == offered["coulomb; spline 5 in |velocity|"].numbers


def test_a_start_leaves_the_refinement_off():
    refined = refine(find("jack.friction", "stribeck"), "linear 1")
    start = start_from(refined, {"Fc": 100.0, "Fs": 150.0, "vs": 0.1})
    assert start == {"Fc": 100.0, "Fs": 150.0, "vs": 0.1, "linear_gain1": 0.0, "linear_T1": 1e-3}


def test_a_formula_says_its_shape():
    shape = formula_shape(find("jack.friction", "stribeck; sign of velocity; spline 5 in |position|; pole"))
    assert shape == FormulaShape("friction", "sign and curve and linear", ("velocity", "|position|"))
    assert formula_shape(find("jack.friction", "stribeck")) is None
    assert formula_shape(find("learned.drive", "command; linear 2")) == FormulaShape("command", "linear", ())
    assert formula_shape(find("learned.flow", "spline 5 in opening")) == FormulaShape(
        "main_flows", "curve", ("opening",)
    )


def test_a_user_s_own_effect_is_refined_too(rig, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        """
from workbench.plant.effects import effect, number

@effect("my.drag", "quadratic", equation="force", slot="body_force", source="own", shows="fast moves",
        numbers=(number("c", 400.0, "N s^2/m^2", low=0.0, high=1e5, off=0.0, meaning="drag"),))
def drag(force, s):
    return force + s.p("c") * s["velocity"] * abs(s["velocity"])
""",
        encoding="utf-8",
    )
    (drag,) = load_effects(path)
    assert differences(rig, refine(drag, "sign of velocity"), (drag,))[0] < 1e-9
    declared = replace(
        rig,
        effects=(EffectUse("my.drag", "quadratic; sign of velocity; pole", {}),),
        effect_files=(str(path),),
    )
    assert "my.drag.pole_body_force1" in [state.name for state in build(declared).states]


def test_every_variable_has_one_meaning():
    """Samples go by word alone, so that a word is one variable everywhere."""
    units = {}
    for effect in LIBRARY:
        for each in variables(effect):
            assert units.setdefault(each.word, each.si) == each.si
            assert variable(effect, each.word) is each
