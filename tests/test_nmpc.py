"""Nonlinear MPC: tangents, its programme, LQG at rest, no offset, the command's limits, and what computing leaves."""

import casadi as ca
import numpy as np
import pytest

from controllers.nmpc import Nmpc
from workbench.loop import ClosedLoop
from workbench.nonlinear_planning import PRICE, STATES

PERIOD = 1e-3
JACK = {
    "velocity_gain": 7.1, "jack_frequency": 27.4, "jack_damping": 0.02, "valve_frequency": 93.8,
    "valve_damping": 0.545, "delay": 0.00082, "inertia": 2.14e5, "error": 0.1, "pressure_noise": 1e6,
}  # fmt: skip
STEP = (np.zeros(STATES), np.array([0.1, 0.0, 0.0, 0.0, 0.0]), 0.0, 0.0, 0.0)


def made(**numbers):
    return Nmpc(Nmpc.Design(**{**JACK, "horizon": 0.04, "moves": 8.0, **numbers}), PERIOD)


@pytest.fixture(scope="module")
def planner():
    return made(iterations=4000.0, pressure=1.2e7)._planner


def test_the_tangents_are_the_differences_of_the_forecast(planner):
    plan = 0.02 * np.cos(np.arange(40) / 5)
    slopes = planner.forecast(*STEP, plan)[2].copy()
    for move in (0, 3, planner.blocks.count - 1):
        bump = 1e-5 * (planner.blocks.of == move)
        ends = [planner.forecast(*STEP, plan + sign * bump)[0][:, 0].copy() for sign in (1, -1)]
        assert slopes[:, move] == pytest.approx((ends[0] - ends[1]) / 2e-5, abs=2e-4)


def test_the_step_is_the_optimum_that_an_independent_solver_finds(planner):
    planner.forget()
    hessian, slope, rows, free = planner.programme(STEP, 0.0)
    hessian, slope, rows, free = (part.copy() for part in (hessian, slope, rows, free))
    k, soft = planner.blocks.count, len(free) - planner._hard
    cost = np.block([[hessian, np.zeros((k, soft))], [np.zeros((soft, k)), PRICE * np.eye(soft)]])
    matrix = np.hstack((rows, np.eye(len(free))[:, planner._hard :]))
    solver = ca.conic("independent", "daqp", {"h": ca.DM(cost).sparsity(), "a": ca.DM(matrix).sparsity()})
    other = solver(h=cost, g=np.append(slope, np.zeros(soft)), a=matrix, lba=-1 - free, uba=1 - free)
    change = planner.change(STEP, 0.0)
    assert not planner._failed
    assert change == pytest.approx(float(other["x"][0]), abs=1e-2)
    assert abs(change) > 0.1


def test_at_rest_the_plan_adds_nothing_and_the_linear_law_tells_the_next_command():
    nmpc = made()
    law = nmpc.linear()
    seen = {"position": 0.0, "pa": 1e7, "pb": 1e7}
    nmpc.reset(0.0, seen, 0.0)
    d = np.asarray(law.D)[0]
    asked = nmpc.compute(1e-5, {"position": -2e-5, "pa": 1.0001e7, "pb": 1e7})
    assert asked == pytest.approx(d @ [1e-5, -2e-5, 1.0001e7, 1e7], rel=1e-2)
    assert d[0] == pytest.approx(nmpc._feedback[0], rel=1e-3)


def looped(engine, rig, rest, controller, reference, force=0.0):
    loop = ClosedLoop(engine, rig, controller, rest)
    return loop.run(reference, {"disturbance": np.full(len(reference), force)})


def test_a_steady_force_leaves_no_offset(engine, rig, rest):
    run = looped(engine, rig, rest, made(command_walk=0.1, pressure_walk=1e7), np.full(2000, 0.005), 5e3)
    assert run.record.signals["position"][-1] == pytest.approx(0.005, abs=2e-5)


def test_a_step_of_100_mm_keeps_the_limits_of_the_command(engine, rig, rest):
    run = looped(engine, rig, rest, made(command=0.3, command_rate=50.0), np.full(400, 0.1))
    command = run.record.signals["command"]
    assert np.abs(command).max() <= 0.3 + 1e-9
    assert np.abs(np.diff(command)).max() <= 0.05 + 1e-9
    assert run.record.signals["position"][-1] == pytest.approx(0.1, rel=0.02)


def test_computing_again_changes_nothing():
    seen = {"position": 0.0, "pa": 1e7, "pb": 1e7}
    nmpc = made()
    nmpc.reset(0.0, seen, 0.0)
    nmpc.update(nmpc.compute(0.1, seen))
    first = [nmpc.compute(0.2, seen) for _ in range(3)]
    assert first == pytest.approx([first[0]] * 3, rel=1e-9)  # the solver scales anew, so not to the last bit
