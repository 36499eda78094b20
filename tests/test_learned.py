"""Learned pieces: off they are not there, physics holds whatever their numbers, a rig file keeps them, and they fit."""

from dataclasses import replace

import numpy as np
import pytest
from effect_laws import BETA, EPS, TRAVEL, evaluated
from hypothesis import given, settings, strategies as st
from refined_plants import differences, graph_of

from workbench.base.errors import InputError
from workbench.engine import Engine
from workbench.engine.emit import first_unsupported
from workbench.engine.engine import back_end_of
from workbench.engine.jobs import Stepping
from workbench.engine.tangent import tangent_attempt, tangent_outputs
from workbench.linear import equilibrium, linearise
from workbench.plant import build
from workbench.plant.effects import EQUATIONS, LIBRARY, applies, find, learned, refine, small_signal, static_curve
from workbench.plant.effects.curves import knots_at
from workbench.plant.effects.natural import natural_samples, variable
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, rig_text

FEW = settings(max_examples=25)
PIECES = tuple(piece for equation in EQUATIONS for piece in learned(equation))
by_piece = pytest.mark.parametrize("piece", PIECES, ids=lambda piece: piece.title)


def test_each_equation_has_pieces_the_cheapest_first_and_none_is_a_name():
    names = {effect.name for effect in LIBRARY}
    for equation in EQUATIONS:
        pieces = learned(equation)
        counts = [len(piece.fitted) for piece in pieces]
        assert counts == sorted(counts)
        assert pieces
        assert all(piece.equation == equation for piece in pieces)
    assert all(piece.name.startswith("learned.") for piece in PIECES)
    assert not names & {piece.name for piece in PIECES}
    assert len({piece.title for piece in PIECES}) == len(PIECES)
    with pytest.raises(InputError, match='no equation "forces"; did you mean "force"'):
        learned("forces")


def test_a_rig_takes_the_pieces_that_it_has_room_for():
    training = load_rig("festo-tp511")
    assert {piece.equation for piece in PIECES if applies(piece, training)} == {"drive", "flow", "force", "sensor"}


@by_piece
def test_off_it_is_not_there_and_typical_it_is(rig, piece):
    off, typical = differences(rig, piece)
    assert off < 1e-9
    assert typical > 1e-6


@by_piece
def test_it_runs_compiled_and_its_slopes_exist(rig, piece):
    plant = build(rig, also=(piece,))
    graph = graph_of(plant)
    assert first_unsupported(graph) is None
    x = plant.start + 0.01 * plant.scale
    assert all(np.isfinite(np.array(part)).all() for part in graph(x, np.zeros(len(plant.inputs)), plant.p))


SHOWN = (
    "learned.friction spline 9 in velocity; spline 5 in position",
    "learned.drive corrector; linear 2",
    "learned.opening lands; spline 9 in opening",
    "learned.sensor pressures; spline 5 in pressure; pole",
)
by_shown = pytest.mark.parametrize("piece", [p for p in PIECES if p.title in SHOWN], ids=lambda piece: piece.title)


def test_what_is_shown_is_there():
    assert {piece.title for piece in PIECES} >= set(SHOWN)


@by_shown
def test_it_plays_and_has_a_linear_model(rig, piece):
    plant = build(rig, also=(piece,))
    rest = equilibrium(plant)
    t = np.arange(41) * 1e-3
    u = np.zeros((41, len(plant.inputs)))
    u[:, 0] = 0.2
    assert Engine(plant, back_end="interpreted").run(rest.x, t, u).ok
    assert np.isfinite(linearise(plant, rest).poles()).all()


@by_shown
def test_a_rig_file_keeps_it_to_the_last_bit(rig, piece, tmp_path):
    numbers = {n.name: Number(n.name, n.typical, n.shown, n.si, "learned") for n in piece.numbers}
    (tmp_path / "rig.toml").write_text(
        rig_text(replace(rig, effects=(EffectUse(piece.name, piece.formula, numbers),))), encoding="utf-8"
    )
    read = load_rig(tmp_path / "rig.toml")
    (tmp_path / "again.toml").write_text(rig_text(read), encoding="utf-8")
    plants = [build(rig, also=(piece,)), build(read), build(load_rig(tmp_path / "again.toml"))]
    np.testing.assert_allclose(plants[1].p, plants[0].p, rtol=2e-16)
    assert np.array_equal(plants[2].p, plants[1].p)
    assert plants[0].parameters == plants[1].parameters == plants[2].parameters
    x, u = plants[0].start + 0.1 * plants[0].scale, 0.1 * np.ones(len(plants[0].inputs))
    assert np.array_equal(np.array(plants[0].f(x, u, plants[1].p)), np.array(plants[2].f(x, u, plants[2].p)))


REFUSED = (
    ("learned.frction", "spline 5 in velocity", 'no learned piece "learned.frction"; did you mean "learned.friction"?'),
    ("learned.friction", "", 'no curve ""; write one like "spline 5 in velocity"'),
    ("learned.friction", "spline 2 in velocity", "a spline has 3 to 15 knots, not 2"),
    ("learned.friction", "spline 5 in pressure", 'nothing there depends on "pressure"'),
    ("learned.drive", "comand; pole", 'no signal "comand"; did you mean "command"?'),
    ("learned.drive", "command; poole", 'no refinement "poole"'),
    ("learned.friction", "spline 5 in velocity; spline 4 in velocity", "velocity_c"),
)


@pytest.mark.parametrize(("name", "formula", "message"), REFUSED, ids=[message for _, _, message in REFUSED])
def test_what_is_not_there_is_told_in_a_line(name, formula, message):
    with pytest.raises(InputError) as caught:
        find(name, formula)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_variable_that_stood_still_is_left_out_and_knots_are_where_it_moved(rig):
    t = np.linspace(0, 1, 200)
    signals = {
        "position": np.full(200, 0.01),
        "velocity": 0.2 * np.sin(9 * t),
        "pa": 1e7 + 1e6 * t,
        "pb": 1e7 - 1e6 * t,
    }
    samples = natural_samples(rig, signals)
    assert samples.keys() == {"position", "velocity", "drop", "pressure"}
    pieces = learned("force", samples, knots=6)
    assert not any("position" in piece.formula for piece in pieces)
    (odd,) = (piece for piece in pieces if piece.title == "learned.friction spline 6 in |velocity|")
    speed = variable(odd, "|velocity|")
    assert [n.typical for n in odd.numbers if n.given] == knots_at(speed, samples["velocity"], 6)


def random_numbers(effect, draw):
    """Any numbers that a fit may choose."""
    return {n.name: draw.draw(st.floats(n.low, n.high)) for n in effect.numbers if not n.given}


@FEW
@given(draw=st.data(), v=st.floats(-1, 1))
@pytest.mark.parametrize(
    "title",
    [
        "friction spline 7 in velocity; spline 5 in position",
        "friction spline 5 in |drop|",
        "damping spline 5 in position",
    ],
)
def test_friction_takes_energy_whatever_the_numbers(title, draw, v):
    name, _, formula = title.partition(" ")
    piece = find(f"learned.{name}", formula)
    place = {"position": draw.draw(st.floats(-0.5, 0.5)), "drop": draw.draw(st.floats(-2e7, 2e7))}
    ((force,), _) = evaluated(piece, "friction", 0.0, random_numbers(piece, draw), velocity=v, **place)
    assert force * v >= 0


@FEW
@given(draw=st.data(), pa=st.floats(1e5, 3e7), pb=st.floats(1e5, 3e7), x=st.floats(-0.3, 0.3))
@pytest.mark.parametrize("formula", ["spline 5 in |drop|", "spline 5 in position"])
def test_what_leaks_past_the_piston_enters_the_other_chamber_and_flows_downhill(formula, draw, pa, pb, x):
    piece = find("learned.leakage", formula)
    context = {"pa": pa, "pb": pb, "drain": 1e5, "position": x}
    ((from_a, from_b), _) = evaluated(piece, "leakage", (0.0, 0.0), random_numbers(piece, draw), **context)
    assert from_a == -from_b
    assert from_a * (pa - pb) >= 0


@FEW
@given(draw=st.data(), p=st.floats(1e5, 3e7), more=st.floats(1e3, 1e7))
def test_a_learned_modulus_is_positive_and_rises_with_pressure(draw, p, more):
    piece = find("learned.modulus", "oil; spline 6 in pressure")
    numbers = random_numbers(piece, draw)
    (low,), (high,) = (evaluated(piece, "modulus", BETA, numbers, pressure=q)[0] for q in (p, p + more))
    assert 0 < low <= high * (1 + 1e-12)
    assert high <= BETA * (1 + 1e-12)


@FEW
@given(draw=st.data(), z=st.floats(-TRAVEL, TRAVEL), more=st.floats(1e-7, 1e-3))
def test_learned_openings_rise_and_stay_positive(draw, z, more):
    piece = find("learned.opening", "lands; spline 7 in opening")
    numbers = random_numbers(piece, draw)

    def openings(at):
        plain = tuple(at_ + EPS if at_ >= 0 else EPS * np.exp(at_ / EPS) for at_ in (at, -at))
        return evaluated(piece, "main_openings", plain, numbers, spool=at, lap=EPS, travel=TRAVEL)[0]

    here, further = openings(z), openings(z + more)
    assert min(here) > 0
    assert further[0] >= here[0]
    assert further[1] <= here[1]


@FEW
@given(draw=st.data(), opening=st.floats(-TRAVEL, TRAVEL), a=st.floats(-1e-3, 1e-3), b=st.floats(-1e-3, 1e-3))
def test_learned_flows_keep_their_sign(draw, opening, a, b):
    piece = find("learned.flow", "spline 7 in opening")
    flows, _ = evaluated(piece, "main_flows", (a, b), random_numbers(piece, draw), opening=opening)
    assert flows[0] * a >= 0
    assert flows[1] * b >= 0


def test_a_curve_is_shown_with_its_slopes():
    piece = find("learned.friction", "spline 5 in |velocity|; pole")
    numbers = {n.name: n.typical for n in piece.numbers} | {"abs_velocity_c1": 900.0}
    at = np.array([-0.5, 0.05, 0.9])
    curve = static_curve(piece, numbers, "velocity", at)
    assert curve.values.shape == (3, 1)
    assert curve.slopes.shape == (3, 1, len(piece.numbers))
    assert curve.values[0, 0] == pytest.approx(-500.0, rel=1e-6)
    assert curve.values[1, 0] > 800.0
    for i, n in enumerate(piece.numbers):
        size = 1e-6 * max(abs(n.typical), 1e-3)
        ahead, behind = (
            static_curve(piece, numbers | {n.name: numbers[n.name] + s}, "velocity", at).values for s in (size, -size)
        )
        assert curve.slopes[..., i] == pytest.approx((ahead - behind) / (2 * size), rel=1e-4, abs=1e-3)


def test_a_linear_element_is_shown_as_gains():
    piece = find("learned.drive", "command; linear 1")
    gains = small_signal(piece)({"linear_gain1": 0.5, "linear_T1": 0.01}, [0.0, 1 / (2 * np.pi * 0.01)])
    assert gains == pytest.approx([1.5, 1 + 0.5 / (1 + 1j)])
    assert small_signal(find("drive.lag", "command filter"))({"tau": 0.0}, [100.0]) == pytest.approx([1.0])


@pytest.mark.parametrize("words", ["main.deadband: linear; linear 1", "learned.opening: lands; linear 1"])
def test_a_linear_element_behind_openings_is_shown_beyond_the_dead_band(words):
    numbers = {"overlap": 0.03, "linear_gain1": 0.5, "linear_T1": 0.01}
    gains = small_signal(find(*words.split(": ")))(numbers, [0.0, 1 / (2 * np.pi * 0.01)])
    assert gains == pytest.approx([1.5, 1 + 0.5 / (1 + 1j)])


def test_tangents_of_a_learned_curve_are_the_limit_of_differences(rig):
    """Along every number at once, in a motion that turns twice; near a turn they need fine steps, as Stribeck's do."""
    piece = refine(find("learned.friction", "spline 5 in |velocity|"), "sign of velocity")
    plant = build(rig, also=(piece,))
    t = np.arange(61) * 1e-3
    u = np.zeros((61, len(plant.inputs)))
    u[:, 0] = 0.05 * np.sin(2 * np.pi * 25 * t)
    start = equilibrium(plant, speed=0.02).x
    dp = np.zeros(len(plant.p))
    for n in piece.fitted:
        dp[plant.parameters.index(piece.key(n.name))] = 0.1 * (n.typical or 1.0)
    graphs = (tangent_attempt(plant), tangent_outputs(plant, plant.outputs), np.append(plant.p, 0 * plant.p))
    runs, _, _ = back_end_of(*graphs, Stepping(1e-8, 2e-5, 200_000), "interpreted")
    batch = runs.run_batch(
        np.append(start, 0 * start)[None], t, np.hstack((u, 0 * u))[None], np.append(plant.p, dp)[None]
    )
    assert batch.ok.all()
    tangent, size = batch.x[0, -1, plant.n :], 1e-3
    fine = Engine(plant, 1e-9, back_end="interpreted")
    ahead, behind = (fine.run(start, t, u, plant.p + s * dp).x[-1] for s in (size, -size))
    differences_ = (ahead - behind) / (2 * size)
    assert np.abs((tangent - differences_) / plant.scale).max() < 5e-3 * np.abs(tangent / plant.scale).max()
