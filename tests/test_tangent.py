"""Tangents of fixed steps: exact, by finite differences, by reverse mode, and the same on either back end."""

import casadi as ca
import numpy as np
import pytest

from workbench.engine.driver import Stepping
from workbench.engine.engine import back_end_of
from workbench.engine.rosenbrock import fixed_step
from workbench.engine.tangent import fixed_attempt, tangent_outputs
from workbench.views import equilibrium

LONGEST, PERIOD, ROWS = 1e-4, 1e-3, 12


@pytest.fixture(scope="module")
def case(plant):
    random = np.random.default_rng(3)
    t = np.arange(ROWS + 1) * PERIOD
    u = np.zeros((ROWS + 1, len(plant.inputs)))
    u[:, 0] = 0.05 * random.standard_normal(ROWS + 1)
    directions = (
        1e-3 * plant.scale * random.standard_normal(plant.n),
        0.1 * plant.p * random.standard_normal(len(plant.p)),
    )
    return t, u, equilibrium(plant, speed=0.02).x, directions


def run(plant, case, back_end):
    t, u, x0, (dx, dp) = case
    graphs = (fixed_attempt(plant), tangent_outputs(plant), np.append(plant.p, 0 * plant.p))
    runs, name, _ = back_end_of(*graphs, Stepping(LONGEST, LONGEST, 10_000), back_end)
    assert name == back_end
    both = np.tile(np.append(x0, 0 * x0), (2, 1))
    both[0, plant.n :] = dx
    along = np.tile(np.append(plant.p, 0 * plant.p), (2, 1))
    along[1, len(plant.p) :] = dp
    batch = runs.run_batch(both, t, u, along)
    assert batch.ok.all()
    assert np.all(batch.attempts == ROWS * round(PERIOD / LONGEST))
    return batch.x, runs.outputs(batch.x, u, along[:, None])


@pytest.fixture(scope="module")
def found(plant, case):
    return run(plant, case, "interpreted")


def stepped(plant, x, u, p):
    advance = fixed_step(plant)
    for held in u[:ROWS]:
        for _ in range(round(PERIOD / LONGEST)):
            x = np.array(advance(x, held, p, LONGEST)).ravel()
    return x


def test_tangents_are_the_limit_of_differences(plant, case, found):
    _, u, x0, (dx, dp) = case
    size = 1e-5
    for lane, (a, b) in enumerate(((dx, 0 * dp), (0 * dx, dp))):
        ahead, behind = (stepped(plant, x0 + s * a, u, plant.p + s * b) for s in (size, -size))
        differences = (ahead - behind) / (2 * size)
        tangent = found[0][lane, -1, plant.n :]
        assert np.abs((tangent - differences) / plant.scale).max() < 1e-6 * max(1, np.abs(tangent / plant.scale).max())


def test_forward_agrees_with_reverse(plant, case, found):
    """<w, J d> of the forward tangent is <J' w, d> of the reverse sweep."""
    _, u, x0, (dx, dp) = case
    x, p = ca.MX.sym("x", plant.n), ca.MX.sym("p", len(plant.p))
    advance, state = fixed_step(plant), x
    for held in u[:3]:
        for _ in range(round(PERIOD / LONGEST)):
            state = advance(state, held, p, LONGEST)
    weights = 1 / plant.scale
    sweep = ca.Function("sweep", [x, p], [ca.gradient(ca.dot(weights, state), ca.vertcat(x, p))])
    gradient = np.array(sweep(x0, plant.p)).ravel()
    for lane, direction in enumerate((np.append(dx, 0 * dp), np.append(0 * dx, dp))):
        forward = weights @ found[0][lane, 3, plant.n :]
        assert forward == pytest.approx(gradient @ direction, rel=1e-8)


def test_outputs_carry_their_tangents(plant, case, found):
    _, u, _, (dx, _) = case
    k = len(plant.outputs)
    states, outputs = found[0][0], found[1][0]
    size = 1e-6
    ahead, behind = (plant.observe(states[:1, : plant.n] + s * dx, u[:1])[0] for s in (size, -size))
    np.testing.assert_allclose(outputs[0, :k], plant.observe(states[:1, : plant.n], u[:1])[0], rtol=1e-12)
    scale = np.abs(outputs[:, k:]).max(axis=0) + 1e-12
    assert np.abs(((ahead - behind) / (2 * size) - outputs[0, k:]) / scale).max() < 1e-4


def test_machine_code_gives_the_same_tangents(plant, case, found):
    pytest.importorskip("llvmlite")
    states, outputs = run(plant, case, "compiled")
    size = np.abs(found[0]).max(axis=(0, 1)) + 1e-300
    assert np.abs((states - found[0]) / size).max() < 1e-9
    assert np.abs((outputs - found[1]) / (np.abs(found[1]).max(axis=(0, 1)) + 1e-12)).max() < 1e-9
