"""The envelope of a position loop: its plants, its linear loops and its steps are those one by one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.commands.run.options import load_config
from workbench.control.piecewise_linear import PiecewiseLinear
from workbench.engine import Engine
from workbench.linear import Equilibrium
from workbench.loop import step_metrics
from workbench.loop.envelope import LinearWorst, command_noise, envelope, steps
from workbench.loop.hard_goals import hardest, linear_goals, motion_goals
from workbench.loop.margins import linear_loop
from workbench.loop.metrics import METRICS
from workbench.loop.rig_variations import variation, with_delay
from workbench.loop.rows import MOVING, loop_setup, play
from workbench.loop.sampled_loop import SampledLoop
from workbench.loop.scenarios import SCENARIOS, Limits
from workbench.plant import build
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
TUNED, MID_STROKE = (
    {spec.name: spec for spec in load_config(EXPERIMENTS / f"position_{name}.toml").controllers}
    for name in ("tuned", "step")
)
RIGS = ("nominal", "mass-50", "beta-50", "stiffness-1e6")
TEN = SCENARIOS["position-10mm"]


@pytest.fixture(scope="module")
def space():
    rig = load_rig("jack-10t")
    rigs = {name: with_delay(variation(rig, name), 0.3e-3) for name in RIGS}
    return envelope(rigs, factors={"M": (0.5, 1.5)}, seed=3)


def test_it_has_every_rig_at_every_position_with_a_specimen_relaxed_there(space):
    assert len(space.varied.names) == 4 * 5
    assert space.nominal.sum() == 5
    assert space.varied.names[0] == "nominal at -216 mm"
    assert space.varied.names[-1] == "stiffness-1e6 at +216 mm"
    assert space.varied.null.ok.all()
    assert space.varied.moving.ok.all()
    assert np.abs(space.drawn.position).max() <= 0.216
    force = space.engine.plant.output("force")
    for at in (space.varied.null, space.varied.moving):
        forces = space.engine.outputs(at.x[:, None], at.u[:, None], space.varied.p[:, None])[:, 0, force]
        assert forces == pytest.approx(np.zeros(20), abs=1e-3)


def test_steps_and_loads_on_a_specimen_off_mid_stroke_are_those_of_the_loop_by_itself(space):
    rig, scenarios = variation(load_rig("jack-10t"), "stiffness-1e6"), (TEN, SCENARIOS["position-load-20kn"])
    setup, lane = loop_setup(with_delay(rig, 0.3e-3)), space.varied.names.index("stiffness-1e6 at -216 mm")
    for scenario in scenarios:
        there = replace(scenario, start=-0.216, duration=1.0)
        run = play(TUNED["p-dp"], there, setup)
        result = steps(space.varied.some([lane]), TUNED["p-dp"].build(1e-3), scenario, None, 1.0)
        expected = np.abs(run.record.signals["position"] + 0.216 - there.reference(run.record.t))
        late = run.record.t >= there.arrives - 1e-9
        assert result.iae[0] == pytest.approx(expected[late].sum() * 1e-3, rel=1e-5)


def test_margins_and_steps_are_those_of_each_plant_by_itself(space):
    controller, lane = TUNED["p-dp"].build(1e-3), space.varied.names.index("mass-50 at +120 mm")
    lanes = space.varied
    null, moving = lanes.margins(controller)
    about = Equilibrium(lanes.null.x[lane], lanes.null.u[lane], 0.0)
    loop = linear_loop(space.engine.plant, about, controller, 1e-3, lanes.p[lane])
    assert null.ms[lane] == pytest.approx(loop.ms, rel=5e-3)
    passing = Equilibrium(lanes.moving.x[lane], lanes.moving.u[lane], MOVING)
    there = linear_loop(space.engine.plant, passing, controller, 1e-3, lanes.p[lane])
    assert moving.ms[lane] == pytest.approx(there.ms, rel=5e-3)
    open_loop = lanes.open_loops(controller, np.array([5.0]))[lane, 0]
    assert open_loop == pytest.approx(np.interp(5.0, loop.f, loop.open), rel=1e-3)
    result = steps(lanes, controller, TEN, None, 1.0)
    plant = replace(space.engine.plant, p=lanes.p[lane])
    run = SampledLoop(Engine(plant), space.rig, TUNED["p-dp"].build(1e-3), about, compiled=False).run(
        np.full(1001, 0.11)
    )
    t, y = run.record.t, run.record.signals["position"]
    assert result.settling[lane] == pytest.approx(step_metrics.settling_time(t, y, 0.11, 0.2e-3), abs=1e-9)
    assert result.overshoot[lane] == pytest.approx(step_metrics.overshoot(y, 0.12, 0.11), abs=1e-3)
    assert result.iae[lane] == pytest.approx(np.abs(0.11 - y).sum() * 1e-3, rel=1e-6)


def test_a_controller_in_python_gives_the_same_as_the_compiled_one(space):
    class Python(type(TUNED["p-dp"].build(1e-3))):
        """The same, but of a class of its own."""

        def compute(self, reference, measurement):
            return super().compute(reference, measurement)

    spec = TUNED["p-dp"]
    shaped = spec.build(1e-3)
    own = Python(shaped.inner, shaped.graph_law())
    lanes = space.varied.some([0, 7])
    for scenario in (TEN, SCENARIOS["position-1mm"]):
        compiled, python = (steps(lanes, law, scenario, None, 0.4) for law in (shaped, own))
        assert python.settling == pytest.approx(compiled.settling, nan_ok=True)
        assert python.iae == pytest.approx(compiled.iae, rel=1e-3)


def test_the_bad_corner_is_no_better_than_any_end_of_a_number(space):
    controller = TUNED["p"].build(1e-3)
    corner = space.corner(controller)
    at_corner = LinearWorst.of(corner, corner.margins(controller))
    at_nominal = LinearWorst.of(space.varied, space.varied.some(range(5)).margins(controller))
    assert corner.names[0] == "bad corner at -216 mm"
    assert at_corner.ms > at_nominal.ms
    beta = space.engine.plant.parameters.index("beta")
    assert corner.p[0, beta] in (0.85e9, 1.15e9)


def test_margins_at_once_are_those_of_each_part(space):
    controller, thin = TUNED["p-dp"].build(1e-3), space.with_drawn(range(300))
    parts = thin.margins(controller)
    assert parts[0][0] is thin.varied
    assert parts[-1][0].names == thin.corner(controller).names
    for lanes, margins in parts:
        for each, alone in zip(margins, lanes.margins(controller), strict=True):
            np.testing.assert_allclose(each.ms, alone.ms, rtol=1e-9)
            np.testing.assert_allclose(each.gain_margin_db, alone.gain_margin_db, rtol=1e-9)


def test_a_rig_without_bounds_has_itself_for_a_bad_corner():
    rig = load_rig("jack-10t")
    bare = replace(rig, numbers={name: replace(n, low=None, high=None) for name, n in rig.numbers.items()})
    corner = envelope({"nominal": bare}, (0.0, 0.5)).corner(TUNED["p"].build(1e-3))
    assert corner.names == ("bad corner at +0 mm", "bad corner at +120 mm")
    assert np.array_equal(corner.p[0], build(rig).p)


def test_of_the_drawn_plants_every_second_is_at_a_position(space):
    places = np.unique(space.varied.position)
    at_one = np.isclose(space.drawn.position[:, None], places).any(axis=1)
    assert at_one[::2].all()
    assert not at_one[1::2].any()


def test_the_hardest_drawn_plants_are_the_worst_of_their_kind(space):
    thin, controller = space.with_drawn(range(300)), TUNED["p-dp"].build(1e-3)
    kinds = hardest(thin, controller, [TEN], 4, Limits())
    every = LinearWorst.of(thin.drawn, thin.drawn.margins(controller))
    calm = steps(thin.drawn, controller, TEN, None, 1.0)
    assert [len(kind) for kind in kinds] == [4, 4, 4]
    assert thin.drawn.names[kinds[0][0]] == every.plant
    assert calm.settling[kinds[1]].tolist() == sorted(calm.settling, reverse=True)[:4]
    assert calm.overshoot[kinds[2]].tolist() == sorted(calm.overshoot, reverse=True)[:4]


def test_what_trips_or_does_not_settle_is_harder_than_what_settles(space):
    thin = space.with_drawn(range(300))
    kinds = hardest(
        thin, MID_STROKE["p-dp"].build(1e-3), [TEN], 4, Limits()
    )  # fixed pressure feedback: hunts at the ends
    worst = thin.drawn.some([kind[0] for kind in kinds])
    assert np.all(np.abs(worst.position) > 0.15)


def test_motions_are_judged_on_the_kept_drawn_plants_too(space):
    thin, controller = space.with_drawn([3, 5]), TUNED["p-dp"].build(1e-3)
    assert thin.played(controller).names == (*thin.varied.names, thin.drawn.names[0], thin.drawn.names[1])
    p, position = thin.drawn.p, thin.drawn.position
    alone, among = (steps(lanes, controller, TEN, None, 0.3) for lanes in (thin.drawn, thin.played(controller)))
    assert among.overshoot[-2:] == pytest.approx(alone.overshoot)
    assert np.array_equal(thin.played(controller).p[-2:], p)
    assert np.array_equal(thin.played(controller).position[-2:], position)
    assert space.with_drawn([]).played(controller).names == space.varied.names


def test_a_number_that_does_not_exist_misses_its_goal(space, monkeypatch):
    def no_number(lanes, controller, scenario, seed, seconds, *_):
        real = steps(lanes, controller, scenario, seed, seconds)
        return replace(real, overshoot=np.where(np.arange(len(real.names)) == 2, np.nan, real.overshoot))

    monkeypatch.setattr("workbench.loop.hard_goals.steps", no_number)
    goals = motion_goals(space.with_drawn([]), TUNED["p-dp"].build(1e-3), [TEN], Limits(overshoot_percent=90))
    (over,) = [goal for goal in goals if goal.limit == 90]
    assert over.miss > 1
    assert over.where == space.varied.names[2]


def test_what_a_load_leaves_on_the_nominal_rig_is_a_goal(space):
    """P leaves what its pressure gain asks for, predictive control little after 0.2 s; in parts of the band."""
    load, met = SCENARIOS["position-load-20kn"], []
    for name in ("p-dp", "mpc"):
        goals = motion_goals(space.with_drawn([]), TUNED[name].build(1e-3), [load], Limits(load_left=0.2))
        (left,) = [goal for goal in goals if goal.limit == 0.2]
        met.append(left.miss == 0)
        assert left.where.startswith("nominal")
    assert met == [False, True]


def test_noise_of_the_command_grows_with_the_gain(space):
    lanes, design = space.varied.some([2]), TUNED["p"].design
    laws = (replace(TUNED["p"], design=replace(design, gain=gain)).build(1e-3) for gain in (0.1, 1.0))
    low, high = (command_noise(lanes, law, "position") for law in laws)
    sensor = space.rig.sensors["position"]
    rms = np.hypot(sensor.noise, sensor.resolution / np.sqrt(12))
    assert low[0] == pytest.approx(0.1 * rms, rel=0.15)
    assert high[0] == pytest.approx(1.0 * rms, rel=0.25)


def test_goals_say_by_how_much_and_where(space):
    thin, controller = space.with_drawn(range(300)), MID_STROKE["p-dp"].build(1e-3)
    # fixed pressure feedback: unstable or nearly so at the ends of the stroke
    goals = {goal.name: goal for goal in linear_goals(thin, controller, Limits())}
    assert goals["stable on every plant"].miss > 0
    assert "216 mm" in goals["stable on every plant"].where
    moved = list(motion_goals(thin, TUNED["p"].build(1e-3), [TEN], Limits()))
    assert [goal.name for goal in moved] == [
        "noise of the command",
        "position-10mm: nowhere trips",
        "position-10mm: nowhere hunts",
    ]
    assert not any(goal.miss for goal in moved)
    tight = {
        goal.name: goal for goal in motion_goals(thin, TUNED["p-dp"].build(1e-3), [TEN], Limits(overshoot_percent=0.2))
    }
    over = tight["position-10mm: overshoot [%]"]
    assert over.miss > 0
    assert over.value == pytest.approx(0.2 * (1 + over.miss))


def test_which_way_a_limit_holds_is_the_metric_s(space, monkeypatch):
    few, law = space.with_drawn([]), TUNED["p-dp"].build(1e-3)

    def missed():
        return {goal.metric for goal in linear_goals(few, law, Limits()) if goal.miss}

    assert not missed()
    for key, way in (("ms", "more"), ("gain_margin_db", "less")):
        monkeypatch.setitem(METRICS, key, replace(METRICS[key], better=way))
    assert missed() == {"ms", "gain_margin_db"}


def test_points_of_a_schedule_hold_beyond_its_ends():
    table = PiecewiseLinear(np.array([-0.2, 0.2]), np.array([0.5, 1.0]))
    assert [table(x) for x in (-1.0, 0.0, 1.0)] == pytest.approx([0.5, 0.75, 1.0])


@pytest.mark.parametrize("supply", [8e5, 1e6])
def test_a_rig_without_an_operating_point_misses_its_goals_and_leaves_the_others_alone(supply):
    rig = load_rig("jack-10t")
    space = envelope({"nominal": rig, "empty": rig.with_values(Ps=supply)}, (0.0, 0.9))
    assert space.varied.null.ok.tolist() == [True, True, False, False]
    law = TUNED["p-dp"].build(1e-3)
    goals = {goal.name: goal for goal in linear_goals(space, law, Limits())}
    assert goals["stable on every plant"].where.startswith("empty at")
    assert goals["stable on every plant"].miss > 0
    assert np.isfinite(goals["stable on every plant"].miss)
    assert goals["Ms on the nominal rig"].miss == 0
    played = steps(space.varied, law, TEN, None, 0.5)
    assert np.isnan(played.settling).tolist() == [False, False, True, True]


@pytest.mark.parametrize("formula", ["coulomb", "lugre"])
@pytest.mark.parametrize("name", ["jack.friction", "main.stiction"])
def test_linear_loops_of_a_rig_that_rubs_are_without_dry_friction(name, formula):
    """As everywhere: at rest it would pass for damping, its falling part for an unstable plant, and the bristles, on
    which nothing rests where they carry no force, for an integrator."""
    rig = load_rig("jack-10t")
    force = Number("Fc", 500.0, "N", "N", "made up")
    rubbing = replace(rig, effects=(EffectUse(name, formula, {"Fc": force}),))
    spaces = [
        envelope({"nominal": each, "supply-20": each.with_values(Ps=0.8 * rig["Ps"])}, (0.0, 0.9)).varied
        for each in (rig, rubbing)
    ]
    loops = [space.margins(TUNED["p-dp"].build(rig.period.value)) for space in spaces]
    for smooth, rubs, moves in zip(*loops, (False, name == "jack.friction"), strict=True):
        assert rubs.ms == pytest.approx(smooth.ms, rel=1e-4)  # a spool at rest lies within a few ppm of the command
        bristles = np.exp(-rig.period.value) if formula == "lugre" and not moves else 0.0  # left alone: decay in 1 s
        assert rubs.radius == pytest.approx(np.maximum(smooth.radius, bristles), rel=1e-9)
    assert all(point.ok.all() for point in (spaces[1].null, spaces[1].moving))
