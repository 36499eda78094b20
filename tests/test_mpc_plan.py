"""The plan of predictive control: the optimum of its programme, the same in Python and compiled."""

import casadi as ca
import numpy as np
import osqp
import pytest
from made_mpc import PERIOD, at_state, drawn_states, made, planned, shipped_spec, ungoverned
from scipy import sparse

from controllers.mpc import Mpc
from workbench.control.mpc_qp import PRICE


def by_active_set(weights, matrix, low, high):
    shapes = {"h": ca.DM(weights).sparsity(), "a": ca.DM(matrix).sparsity()}
    return np.array(ca.conic("independent", "daqp", shapes)(h=weights, a=matrix, lba=low, uba=high)["x"]).ravel()


def by_splitting(weights, matrix, low, high):
    solver = osqp.OSQP()
    solver.setup(
        sparse.csc_matrix(weights), np.zeros(len(weights)), sparse.csc_matrix(matrix), low, high,
        eps_abs=1e-9, eps_rel=1e-9, max_iter=200_000, polishing=True, verbose=False,
    )  # fmt: skip
    return solver.solve(raise_error=True).x


@pytest.mark.parametrize("solved", [by_active_set, by_splitting])
def test_the_plan_is_the_optimum_that_an_independent_solver_finds(solved):
    """Other solvers on the same programme, where the command, its rate, speed and pressure are limited; a limit of the
    jack can be passed at a price."""
    mpc = ungoverned(made(speed=2.0, pressure=1.5e7, horizon=0.06, moves=12))
    law, limited, arrived = planned(mpc), 0, 0
    m, soft, k = len(law.horizon.soft), law.horizon.soft, law.horizon.gains.shape[1]
    matrix = np.hstack((law.horizon.gains, np.eye(m)[:, soft]))
    weights = np.diag(np.append(np.bincount(law.horizon.blocks), np.full(int(soft.sum()), PRICE)).astype(float))
    for state, reference, before in drawn_states(mpc, 40, 3):
        asked = law.feedforward[:, 0] * reference
        free = law.horizon.free @ np.concatenate((state, asked, [before]))
        command, kept = at_state(mpc, state, reference, before)[:2]
        if not kept:
            continue
        other = solved(weights, matrix, -1 - free, 1 - free)
        assert command == pytest.approx(asked[0] - law.law.feedback @ state + other[0], abs=1e-6)
        arrived, limited = arrived + 1, limited + (np.abs(other[:k]).max() > 0.02)
    assert arrived >= 20
    assert limited >= 12


@pytest.mark.parametrize("law", ["mpc", "mpc-bare", "soft"])
def test_osqp_and_the_compact_active_set_find_the_same_command(law):
    """What Python computes and what compiled loops, C and Structured Text compute; limits of the jack are passed, and
    where the command before is out of every limit no plan keeps them."""
    soft = made(speed=2.0, pressure=1.5e7, horizon=0.06, moves=12)
    mpc = soft if law == "soft" else Mpc(shipped_spec(law).design, PERIOD)
    kernel = planned(mpc).kernel
    worst = limited = infeasible = 0
    for shrunk in (0.05, 0.3, 1.0, 1.5):
        for state, reference, before in drawn_states(mpc, 667, 6):
            before = before * (40 if shrunk > 1 else 1)
            given = np.concatenate((shrunk * state, [0.0, shrunk * before], np.full(3, np.nan), [shrunk * reference]))
            compact = kernel(given).copy()
            found = kernel.in_graphs(given)
            worst = max(worst, abs(found[0] - compact[0]))
            limited += abs(found[0]) > 1e-6
            infeasible += compact[1] < 1
    assert worst < 1e-6
    assert limited > 1000
    assert infeasible > 10


@pytest.mark.parametrize("name", ["mpc", "mpc-bare"])
def test_machine_code_and_python_find_the_same(name):
    """The kernel is written once; where no machine code can be made it runs as it is written."""
    mpc = Mpc(shipped_spec(name).design, PERIOD)
    for state, reference, before in drawn_states(mpc, 20, 4):
        found, alone = at_state(mpc, state, reference, before).copy(), np.zeros(planned(mpc).kernel.shape.found)
        planned(mpc).kernel.in_python(planned(mpc).kernel._given, alone)
        assert found == pytest.approx(alone, rel=1e-9, abs=1e-12)


def test_the_bound_that_spares_a_look_at_every_limit_changes_nothing():
    """Against a kernel that always looks, on states from rest to beyond the limits; it does spare some."""
    mpc, looking = (Mpc(shipped_spec("mpc").design, PERIOD) for _ in range(2))
    planned(looking).kernel.table("BOUNDS")[:] = 1e6
    moved = 0
    for shrunk in np.geomspace(1e-3, 1.0, 20):
        for state, reference, before in drawn_states(mpc, 20, 5):
            given = shrunk * state, shrunk * reference, shrunk * before
            found = at_state(mpc, *given).copy()
            assert np.array_equal(found, at_state(looking, *given))
            law = planned(mpc)
            free = law.feedforward[0, 0] * given[1] - law.law.feedback @ given[0]
            moved += abs(found[0] - free) > 1e-6
    assert 40 < moved < 360
