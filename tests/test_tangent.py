"""Tangents of adaptive steps: by finite differences, by reverse mode, and the same on either back end."""

import casadi as ca
import numpy as np
import pytest

from workbench.engine import Engine
from workbench.engine.engine import back_end_of
from workbench.engine.jobs import Stepping
from workbench.engine.tangent import tangent_attempt, tangent_outputs
from workbench.linear import equilibrium

TOLERANCE, FIRST, PERIOD, ROWS = 1e-6, 2e-5, 1e-3, 12


@pytest.fixture(scope="module")
def case(plant):
    random = np.random.default_rng(3)
    t = np.arange(ROWS + 1) * PERIOD
    u = np.zeros((ROWS + 1, len(plant.inputs)))
    u[:, 0] = 0.05 * random.standard_normal(ROWS + 1)
    directions = (
        1e-3 * plant.scale * random.standard_normal(plant.n),
        1e-3 * random.standard_normal(u.shape) * [i.scale for i in plant.inputs],
        0.1 * plant.p * random.standard_normal(len(plant.p)),
    )
    return t, u, equilibrium(plant, speed=0.02).x, directions


def run(plant, case, back_end):
    """States [3, rows, 2 n] and changes of the outputs: one lane each along x0, u and p."""
    t, u, x0, (dx, du, dp) = case
    graphs = (tangent_attempt(plant), tangent_outputs(plant, plant.outputs), np.append(plant.p, 0 * plant.p))
    runs, name, _ = back_end_of(*graphs, Stepping(TOLERANCE, FIRST, 10_000), back_end)
    assert name == back_end
    both = np.tile(np.append(x0, 0 * x0), (3, 1))
    both[0, plant.n :] = dx
    held = np.tile(np.hstack((u, 0 * u)), (3, 1, 1))
    held[1, :, u.shape[1] :] = du
    along = np.tile(np.append(plant.p, 0 * plant.p), (3, 1))
    along[2, len(plant.p) :] = dp
    batch = runs.run_batch(both, t, held, along)
    assert batch.ok.all()
    return batch.x, runs.outputs(batch.x, held, along[:, None])


@pytest.fixture(scope="module")
def found(plant, case):
    return run(plant, case, "interpreted")


def test_the_states_are_those_of_a_plain_run(plant, case, found):
    t, u, x0, _ = case
    plain = Engine(plant, TOLERANCE, "interpreted").run(x0, t, u).x
    for lane in found[0]:
        np.testing.assert_allclose(lane[:, : plant.n], plain, rtol=1e-12, atol=1e-14)


def test_tangents_are_the_limit_of_differences(plant, case, found):
    t, u, x0, (dx, du, dp) = case
    fine, size = Engine(plant, 1e-9), 1e-4
    for lane, (a, b, c) in enumerate(((dx, 0 * du, 0 * dp), (0 * dx, du, 0 * dp), (0 * dx, 0 * du, dp))):
        ahead, behind = (fine.run(x0 + s * a, t, u + s * b, plant.p + s * c).x[-1] for s in (size, -size))
        differences = (ahead - behind) / (2 * size)
        tangent = found[0][lane, -1, plant.n :]
        assert np.abs((tangent - differences) / plant.scale).max() < 2e-3 * np.abs(tangent / plant.scale).max()


def test_forward_agrees_with_reverse(plant, case):
    """Of one attempt, <w, J d> of the forward tangent is <J' w, d> of the reverse sweep."""
    _, u, x0, (dx, du, dp) = case
    n, clock = plant.n, np.array([PERIOD, FIRST, 0.0])
    attempt = tangent_attempt(plant)
    x, v, p = ca.MX.sym("x", n), ca.MX.sym("v", u.shape[1]), ca.MX.sym("p", len(plant.p))
    still = (ca.DM.zeros(n), ca.DM.zeros(u.shape[1]), ca.DM.zeros(len(plant.p)))
    after = attempt(ca.vertcat(x, still[0], clock), ca.vertcat(v, still[1]), ca.vertcat(p, still[2]), TOLERANCE)
    weights = 1 / plant.scale
    sweep = ca.Function("sweep", [x, v, p], [ca.gradient(ca.dot(weights, after[:n]), ca.vertcat(x, v, p))])
    gradient = np.array(sweep(x0, u[1], plant.p)).ravel()
    moved = attempt(np.concatenate((x0, dx, clock)), np.append(u[1], du[1]), np.append(plant.p, dp), TOLERANCE)
    forward = weights @ np.array(moved).ravel()[n : 2 * n]
    assert forward == pytest.approx(gradient @ np.concatenate((dx, du[1], dp)), rel=1e-8)


def test_outputs_carry_their_tangents(plant, case, found):
    _, u, _, (dx, du, dp) = case
    size = 1e-6
    for lane, (a, b, c) in enumerate(((dx, 0 * du[0], 0 * dp), (0 * dx, du[0], 0 * dp), (0 * dx, 0 * du[0], dp))):
        x = found[0][lane, 0, : plant.n]
        ahead, behind = (plant.observe(x + s * a, u[0] + s * b, plant.p + s * c)[0] for s in (size, -size))
        differences, tangent = (ahead - behind) / (2 * size), found[1][lane, 0]
        assert np.abs((differences - tangent) / (np.abs(found[1][lane]).max(axis=0) + 1e-12)).max() < 1e-4


def test_machine_code_gives_the_same_tangents(plant, case, found):
    pytest.importorskip("llvmlite")
    states, outputs = run(plant, case, "compiled")
    size = np.abs(found[0]).max(axis=(0, 1)) + 1e-300
    assert np.abs((states - found[0]) / size).max() < 1e-9
    assert np.abs((outputs - found[1]) / (np.abs(found[1]).max(axis=(0, 1)) + 1e-12)).max() < 1e-9
