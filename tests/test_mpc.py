"""Linear MPC: LQG far from limits, the optimum of its programme near them, limits kept, and what goes wrong counted."""

import casadi as ca
import numpy as np
import pytest

from controllers.lqg import Lqg, lq_gain
from controllers.mpc import Mpc
from controllers.pressure import PressureFeedback
from controllers.shaping import Shaping
from workbench.control.compensators import Compensated
from workbench.control.kalman_observer import JackObserver
from workbench.control.mpc_qp import Limits, Planner, build_horizon
from workbench.loop.sampled_loop import SampledLoop

PERIOD = 1e-3
JACK = {
    "velocity_gain": 7.4, "jack_frequency": 31.6, "jack_damping": 0.357, "valve_frequency": 93.8,
    "valve_damping": 0.545, "delay": 0.00082, "inertia": 2.14e5, "error": 0.2,
}  # fmt: skip
FREE = {"command_rate": 1e4, "stroke": 10.0, "speed": 100.0, "pressure": 1e8}


def made(**numbers):
    return Mpc(Mpc.Design(**{**JACK, **numbers}), PERIOD)


def courses(controllers, count, seed=0):
    """The commands of several controllers on the same signals, each knowing what the first one sends."""
    drawn = np.random.default_rng(seed)
    seen = {"position": 0.0, "pa": 1e7, "pb": 1e7, "spool": 0.0}
    for one in controllers:
        one.reset(0.0, seen, 0.01)
    found = []
    for _ in range(count):
        seen = {"position": drawn.normal(0, 1e-3), "pa": 1e7 + drawn.normal(0, 1e5), "pb": 1e7, "spool": 0.0}
        found.append([one.compute(2e-3, seen) for one in controllers])
        for one in controllers:
            one.update(found[-1][0])
    return np.array(found)


def test_far_from_every_limit_it_is_lqg():
    lqg = Lqg(Lqg.Design(**JACK), PERIOD)
    mpc = made(**FREE)
    both = courses([mpc, lqg], 50)
    assert both[:, 0] == pytest.approx(both[:, 1], abs=1e-12)
    assert pytest.approx(np.asarray(lqg.linear().A)) == mpc.linear().A
    assert mpc.fallbacks == 0


@pytest.fixture(scope="module")
def planner():
    d = Mpc.Design(**JACK)
    observer = JackObserver(d, PERIOD)
    feedback = np.append(lq_gain(observer, d.error), [1.0, 0.0])
    return Planner(build_horizon(observer, feedback, Limits(1.0, 0.2, 0.24, 2.0, 1.5e7), 60, 12), 4000)


def test_the_plan_is_the_optimum_that_an_independent_solver_finds(planner):
    """An active-set method on the same programme, for steps that the command, its rate, speed and pressure limit."""
    order = planner.horizon.free.shape[1] - 61
    solver = ca.conic(
        "independent",
        "daqp",
        {"h": ca.DM(np.diag(planner.weights)).sparsity(), "a": ca.DM(planner.matrix).sparsity()},
    )
    drawn, limited = np.random.default_rng(3), 0
    for _ in range(12):
        state = np.zeros(order)
        state[0], state[-1] = drawn.normal(0, 0.1), drawn.normal(0, 1e6)
        wanted = np.full(60, drawn.normal(0, 0.1) / 0.2)
        planner.reset()
        change, free = planner.plan(state, wanted, 0.0), planner.free(state, wanted, 0.0)
        other = solver(h=np.diag(planner.weights), a=planner.matrix, lba=-1 - free, uba=1 - free)
        assert change == pytest.approx(float(other["x"][0]), abs=5e-3)
        limited += abs(change) > 0.02
    assert limited >= 6


def looped(engine, rig, rest, controller, reference, force=0.0):
    """On the jack that its model is of: damped by pressure feedback."""
    damped = Compensated(controller, PressureFeedback(PressureFeedback.Design(gain=2e-9, corner=1.0), PERIOD))
    loop = SampledLoop(engine, rig, damped, rest)
    return loop.run(reference, {"disturbance": np.full(len(reference), force)})


def test_a_step_of_100_mm_keeps_the_rate_and_the_pressure_that_it_was_given(engine, rig, rest):
    step = np.full(600, 0.1)
    pressures = []
    for limit in (5e6, 2e7):
        run = looped(engine, rig, rest, made(command_rate=20.0, pressure=limit), step)
        signals = run.record.signals
        pressure_feedback = 2e-9 * np.abs(np.diff(signals["pa"] - signals["pb"])).max()
        assert np.abs(np.diff(signals["command"])).max() <= 20.0 * PERIOD + pressure_feedback
        assert signals["position"][-1] == pytest.approx(0.1, rel=0.02)
        pressures.append(np.abs(signals["pa"] - signals["pb"]).max())
    assert pressures[0] < 0.6 * pressures[1]


def test_a_speed_limit_is_kept(engine, rig, rest):
    run = looped(engine, rig, rest, made(speed=0.5), np.full(800, 0.1))
    assert np.abs(run.record.signals["velocity"]).max() < 0.7
    assert run.record.signals["position"][-1] == pytest.approx(0.1, rel=0.02)


def test_a_steady_force_leaves_no_offset(engine, rig, rest):
    run = looped(engine, rig, rest, made(command_walk=0.1), np.full(3000, 0.005), 5e3)
    assert run.record.signals["position"][-1] == pytest.approx(0.005, abs=2e-5)


def test_a_solver_that_does_not_arrive_is_counted_and_the_last_plan_goes_on(engine, rig, rest):
    tight = made(command_rate=20.0, pressure=5e6, iterations=10)
    run = looped(engine, rig, rest, tight, np.full(600, 0.1))
    assert tight.fallbacks > 0
    assert run.tripped is None
    assert run.record.signals["position"][-1] == pytest.approx(0.1, rel=0.02)


def test_computing_again_changes_nothing():
    """The protocol's promise, for a controller that starts its solver from the solution before."""
    seen = {"position": 0.0, "pa": 1e7, "pb": 1e7}
    mpc = made()
    mpc.reset(0.0, seen, 0.0)
    first = [mpc.compute(0.2, seen) for _ in range(3)]
    mpc.update(first[0])
    assert first == [first[0]] * 3


def test_with_a_preview_the_law_is_the_optimum_over_the_whole_course():
    """Against the least squares of a finite course that is long: the first command for references known ahead."""
    d = Mpc.Design(**JACK)
    observer, steps, known = JackObserver(d, PERIOD), 700, 60
    a, b, c = observer.a, observer.b[:, 0], observer.signals["position"][:-2]
    future = 1e-3 * np.sin(np.arange(known + 1) / 10)
    course = np.append(future, np.full(steps - known, future[-1]))
    answers = np.array([c @ np.linalg.matrix_power(a, i) @ b for i in range(steps)])
    moved = np.array([[answers[i - j] if j <= i else 0.0 for j in range(steps)] for i in range(steps)])
    both = np.vstack((moved / d.error, np.eye(steps)))
    best = np.linalg.lstsq(both, np.append(course[1:] / d.error, np.zeros(steps)), rcond=None)[0]
    mpc = made(preview=known * PERIOD, **FREE)
    seen = {"position": 0.0, "pa": 1e7, "pb": 1e7}
    mpc.reset(0.0, seen, 0.0)
    mpc.set_preview(future)
    assert mpc.compute(future[0], seen) == pytest.approx(best[0], rel=1e-3)


def test_a_sine_that_is_known_ahead_is_followed_closer(engine, rig, rest):
    """Through a compensator that shapes the reference as well, which the preview has to pass."""
    t = np.arange(1500) * PERIOD
    wanted, errors = 2e-3 * np.sin(2 * np.pi * 5 * t), []
    for seconds in (0.0, 0.06):
        fast = Shaping(Shaping.Design(corner=2000.0), PERIOD)
        run = looped(engine, rig, rest, Compensated(made(preview=seconds), fast), wanted)
        errors.append(np.abs(run.record.signals["position"] - wanted)[500:].mean())
    assert errors[1] < 0.5 * errors[0]


def test_a_spool_sensor_serves_the_filter(engine, rig, rest):
    """Measured or not, the step arrives; the filter's valve state is what the spool shows."""
    mpc = made(spool_travel=rig["z3max"])
    assert mpc.measures == ("position", "pa", "pb", "spool")
    signals = looped(engine, rig, rest, mpc, np.full(400, 0.01)).record.signals
    assert signals["position"][-1] == pytest.approx(0.01, rel=0.02)
    assert mpc._observer.state[3] == pytest.approx(signals["spool"][-1] / rig["z3max"], abs=2e-3)
