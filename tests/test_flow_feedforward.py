"""Flow feed-forward: a planned reference within its limits, and the command that its flow takes."""

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.signal import bilinear, lfilter

from controllers import FlowFeedForward, LapInverse, P, PressureFeedback
from workbench.base.errors import InputError
from workbench.commands.run.options import load_config
from workbench.linear.equilibria import Equilibria
from workbench.loop.batch import play_lanes
from workbench.loop.lane_laws import lane_laws
from workbench.loop.rows import linear_loops, loop_setup
from workbench.loop.sampled_loop import SampledLoop
from workbench.rigs.rig_file import load_rig

PERIOD = 1e-3
TUNED = Path(__file__).parents[1] / "experiments" / "position_tuned.toml"
FLOW = FlowFeedForward(
    velocity_gain=7.6,
    acceleration=60.0,
    smoothing="36 ms",
    speed=1.0,
    lead="2.5 ms",
    lag="3.3 ms",
    corner=2.6,
    mode=27.4,
    inertia=2.141e5,
    drop="205.6 bar",
    drain="4.355 bar",
    measured=1.0,
)
LOOP = P(gain=3.0) + PressureFeedback(gain="2e-4 1/bar", corner=2.6) + FLOW + LapInverse(excess=2e-3, width=2e-3)


def planned(reference, **numbers):
    """The motion that a plan makes of a reference [k], and the command for its flow."""
    spec = P(gain=1e-3) + FlowFeedForward(**{"velocity_gain": 5.0, "acceleration": 20.0, **numbers})
    plan = spec.build(PERIOD).graph_law().shell
    w, r, q = ca.SX.sym("w", len(plan.names)), ca.SX.sym("r"), ca.SX(ca.DM(plan.numbers))
    passed = plan.passed(w, {"reference": r}, q)
    output = ca.Function("output", [w, r], [passed.signals["reference"], passed.forth(ca.SX(0))])
    advance = ca.Function("after", [w, r], [plan.after(w, {"reference": r}, ca.SX(0), q)])
    w, motion, command = np.zeros(len(plan.names)), *np.empty((2, len(reference)))
    for i, r in enumerate(reference):
        motion[i], command[i] = map(float, output(w, r))
        w = np.array(advance(w, r)).ravel()
    return motion, command


def test_a_step_becomes_a_motion_within_speed_acceleration_and_jerk():
    motion, _ = planned(np.full(400, 0.1), smoothing=0.02, speed=0.5)
    speed = np.diff(motion, prepend=0.0) / PERIOD
    acceleration = np.diff(speed, prepend=0.0) / PERIOD
    jerk = np.diff(acceleration, prepend=0.0) / PERIOD
    assert speed.max() == pytest.approx(0.5, rel=1e-6)
    assert np.abs(acceleration).max() == pytest.approx(20.0, rel=1e-6)
    assert np.abs(jerk).max() <= 20.0 / 0.02 * (1 + 1e-6)
    assert motion.max() <= 0.1 * (1 + 1e-9)
    still = 0.1 / 0.5 + 0.5 / 20 + 0.02  # s: at 0.5 m/s, with both ramps, and the average
    assert motion[round(still / PERIOD) + 4 :] == pytest.approx(0.1, abs=1e-12)
    assert motion[round(still / PERIOD) - 8] < 0.1 * (1 - 1e-5)


def test_the_command_is_the_speed_over_the_velocity_gain_and_comes_before_the_motion():
    motion, command = planned(np.full(200, 0.01), smoothing=0.01, lead=3e-3)
    speed = np.diff(motion, prepend=0.0) / PERIOD
    assert command[:-3] == pytest.approx(speed[3:] / 5.0, abs=1e-6)


def test_lag_mode_load_and_drop_have_their_parts():
    motion, plain = planned(np.full(200, 0.01), smoothing=0.02)
    v = np.diff(motion, prepend=0.0) / PERIOD
    a = np.diff(v, prepend=0.0) / PERIOD
    j = np.diff(a, prepend=0.0) / PERIOD
    _, command = planned(np.full(200, 0.01), smoothing=0.02, lag=3e-3, mode=20.0)
    assert command == pytest.approx((v + 3e-3 * a + j / (2 * np.pi * 20) ** 2) / 5, abs=1e-9)
    _, high = planned(np.full(200, 0.01), smoothing=0.02, lag=3e-3, corner=5.0)
    passed = np.asarray(lfilter(*bilinear([1, 0], [1, 2 * np.pi * 5.0], 1 / PERIOD), a))
    assert high == pytest.approx((v + 3e-3 * passed) / 5, abs=1e-6)
    _, loaded = planned(np.full(200, 0.01), smoothing=0.02, inertia=2e5, drop=2e7)
    assert loaded == pytest.approx(plain * np.sqrt(2e7 / (2e7 - np.sign(v) * 2e5 * a)), abs=1e-9)


def test_a_new_reference_on_the_way_is_followed_from_there():
    reference = np.concatenate((np.full(30, 0.05), np.full(400, -0.02)))
    motion, _ = planned(reference, smoothing=0.02)
    speed = np.diff(motion, prepend=0.0) / PERIOD
    assert np.abs(np.diff(speed)).max() / PERIOD <= 20.0 * (1 + 1e-6)
    assert motion[-1] == pytest.approx(-0.02, abs=1e-12)


def test_more_smoothing_than_is_kept_is_refused():
    with pytest.raises(InputError, match="59 ms together at most; take less"):
        (P(gain=1.0) + FlowFeedForward(velocity_gain=1.0, acceleration=1.0, smoothing=0.06)).build(PERIOD)


def test_it_runs_compiled_as_in_python():
    rig = load_rig("jack-10t")
    setup = loop_setup(rig)
    reference = np.full(200, 0.01)
    runs = [
        SampledLoop(setup.engine, rig, LOOP.build(PERIOD), setup.null, 3, compiled=compiled).run(reference)
        for compiled in (True, False)
    ]
    assert runs[0].tripped is None
    fast, slow = (run.record.signals["position"] for run in runs)
    assert fast == pytest.approx(slow, abs=2e-6)
    assert np.abs(slow[65:] - 0.01).max() < 4e-4


def test_mpc_within_a_plan_runs_in_lanes_as_alone():
    (tuned,) = (spec for spec in load_config(TUNED).controllers if spec.name == "mpc")
    plan = LOOP.compensators[1]
    controller = replace(tuned, compensators=(plan, *tuned.compensators[:2]))
    rig = load_rig("jack-10t")
    setup = loop_setup(rig)
    null, p = setup.null, np.tile(setup.engine.plant.p, (2, 1))
    points = Equilibria(np.tile(null.x, (2, 1)), np.tile(null.u, (2, 1)), np.ones(2, bool))
    steps = np.array([[0.01], [-0.02]]) * np.ones(80)
    ((_, lanes),) = play_lanes(setup.engine, rig, controller.build(PERIOD), points, p, steps, ("position",))
    for step, position in zip(steps, lanes.signals["position"], strict=True):
        alone = SampledLoop(setup.engine, rig, controller.build(PERIOD), null).run(step)
        assert position == pytest.approx(alone.record.signals["position"], abs=2e-6)


WITHOUT = P(gain=3.0) + PressureFeedback(gain="2e-4 1/bar", corner=2.6) + LapInverse(excess=2e-3, width=2e-3)


def test_a_law_of_a_loop_in_lanes_has_no_states_of_the_plan():
    names = ("position", "pa", "pb", "supply", "command", "stiffness")
    points = {name: np.array([0.0, 0.1]) for name in names}
    planned_law, plain = (lane_laws(spec.build(PERIOD), points) for spec in (LOOP, WITHOUT))
    assert planned_law.a.shape == plain.a.shape
    assert planned_law.c == pytest.approx(plain.c)


def test_it_leaves_the_margins_alone():
    setup = loop_setup(load_rig("jack-10t"))
    planned_loop, plain = (linear_loops(spec, setup).null for spec in (LOOP, WITHOUT))
    assert planned_loop.ms == pytest.approx(plain.ms, rel=1e-9)
    assert planned_loop.gain_margin_db == pytest.approx(plain.gain_margin_db, rel=1e-9)
