"""The engine: order and accuracy against other solvers, held inputs, flagged failures, and nothing remembered."""

import sys
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp

from workbench.base.errors import InputError
from workbench.engine import Engine
from workbench.engine.rosenbrock import ORDER, SparseLU, adaptive_attempt, fixed_step, markowitz_order
from workbench.plant.assembly import Assembly


def scaled_error(plant, a, b):
    return float(np.abs((a - b) / plant.scale).max())


@pytest.fixture(scope="module")
def stiff():
    """Prothero and Robinson: x' = c' - rate (x - c), with c = cos(t + y) known, beside a clock and an oscillator."""
    b = Assembly("stiff", {"rate": 1e4})
    b.input("shift", "1", 1.0)
    x, clock, y, z = (b.state(name, "1", 1.0) for name in ("x", "clock", "y", "z"))
    b.rate("clock", ca.SX(1))
    b.rate("x", -ca.sin(clock) - b["rate"] * (x - ca.cos(clock)) + 0.1 * (x - ca.cos(clock)) * y)
    b.rate("y", z * (1 + 0.1 * y * y))
    b.rate("z", -y)
    b.output(x=x)
    return b.finish()


def march(plant, x, u, duration, count):
    step = fixed_step(plant)
    for _ in range(count):
        x = np.array(step(x, u, plant.p, duration / count)).ravel()
    return x


def observed_order(errors):
    """Slope of the error over the step, for steps halved each time."""
    return np.log2(errors[:-1] / errors[1:])


def test_order_three_on_a_smooth_plant(stiff):
    p = stiff.parameter_values(rate=1.0)
    step = fixed_step(stiff)
    ends = []
    for count in (20, 40, 80, 160, 2560):
        x = np.array([1.2, 0.0, 0.5, 0.0])
        for _ in range(count):
            x = np.array(step(x, [0.0], p, 2.0 / count)).ravel()
        ends.append(x)
    errors = np.array([np.abs(end - ends[-1]).max() for end in ends[:-1]])
    assert np.all(np.abs(observed_order(errors) - ORDER) < 0.2)


def test_a_stiff_plant_is_followed_with_steps_far_beyond_its_fastest_mode(stiff):
    """h rate = 500..62: L-stability; the order may fall to 2 there, the error must not explode."""
    x0 = np.array([1.0, 0.0, 0.5, 0.0])
    errors = np.array([abs(march(stiff, x0, [0.0], 2.0, count)[0] - np.cos(2.0)) for count in (40, 80, 160, 320)])
    assert errors[0] < 1e-4
    assert np.all(observed_order(errors) > 1.7)
    far = march(stiff, np.array([1.5, 0.0, 0.5, 0.0]), [0.0], 0.05, 1)
    assert abs(far[0] - np.cos(0.05)) < 0.5 * 0.02  # a wrong start is forgotten in one step


def test_order_three_on_the_jack(plant, rest, commanded):
    (u,) = commanded([0.02])
    start = march(plant, rest.x, u, 4e-3, 4000)  # past the first kick
    best = march(plant, start, u, 1e-3, 4096)
    errors = np.array([scaled_error(plant, march(plant, start, u, 1e-3, count), best) for count in (64, 128, 256, 512)])
    assert np.all(np.abs(observed_order(errors)[1:] - ORDER) < 0.35)


@pytest.fixture(scope="module")
def radau(plant, rest):
    """States after each hold by scipy's Radau at 1e-10 with the exact Jacobian, in scaled states."""
    x, u = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(plant.inputs))
    rates = plant.f(x, u, plant.p)
    scale, xs, us = plant.scale, np.zeros(plant.n), np.zeros(len(plant.inputs))
    calls, results = [], []
    for value in (rates, ca.densify(ca.jacobian(rates, x))):
        buffer, call = ca.Function("part", [x, u], [value]).buffer()
        result = np.zeros(value.shape[::-1])  # CasADi is column-major
        for index, array in enumerate((xs, us)):
            buffer.set_arg(index, array.data)
        buffer.set_res(0, result.data)
        calls.append((buffer, call))
        results.append(result)

    def rate(_t, z):
        xs[:] = z * scale
        calls[0][1]()
        return results[0][0] / scale

    def slope(_t, z):
        xs[:] = z * scale
        calls[1][1]()
        return results[1].T * scale / scale[:, None]

    def run(t, held):
        states = [rest.x / scale]
        for j, span in enumerate(np.diff(t)):
            us[:] = held[j]
            found = solve_ivp(rate, (0, span), states[-1], method="Radau", jac=slope, rtol=1e-10, atol=1e-10)
            states.append(found.y[:, -1])
        return np.array(states) * scale

    return run


def test_it_agrees_with_radau(plant, rest, commanded, radau):
    """30 ms of hard excitation held over uneven intervals: the tighter the tolerance, the nearer to Radau at 1e-10."""
    t = np.array([0.0, 5e-3, 10e-3, 12e-3, 12.3e-3, 20e-3, 30e-3])
    u = commanded([0.5, -0.2, 0.1, -1.0, 0.3, 0.0])
    wanted = radau(t, u)
    for tolerance, allowed in ((1e-9, 1e-7), (1e-7, 1e-5), (1e-5, 5e-4)):
        run = Engine(plant, tolerance).run(rest.x, t, u)
        assert run.ok
        assert scaled_error(plant, run.x, wanted) < allowed


@pytest.fixture(scope="module")
def fine(plant):
    return Engine(plant, 1e-8)  # within 1e-6 of Radau, see above


@pytest.mark.parametrize(
    ("shape", "allowed"),
    [
        (lambda t: 0.1 * np.sin(2 * np.pi * 3 * t) + 0.03 * np.sin(2 * np.pi * 17 * t), 1e-4),
        (lambda t: 0.1 * np.sin(2 * np.pi * 5 * t), 1e-4),
        (lambda t: 0.3 * np.sign(np.sin(2 * np.pi * 4 * t + 0.1)), 2.5e-4),
    ],
    ids=["two sines", "sine", "square wave"],
)
def test_a_second_at_the_default_tolerance(plant, engine, fine, rest, commanded, shape, allowed):
    """Error of every state at every sample, over the state's magnitude."""
    t = np.arange(2001) * 5e-4
    u = commanded(shape(t))
    assert scaled_error(plant, engine.run(rest.x, t, u).x, fine.run(rest.x, t, u).x) < allowed


def test_inputs_are_held_over_uneven_times(plant, fine, rest, commanded):
    """Cutting a hold into pieces changes nothing but the samples."""
    t = np.array([0.0, 1e-3, 4e-3, 4.1e-3, 9e-3, 20e-3])
    command = np.array([0.2, -0.3, 0.6, 0.0, 0.1])
    whole = fine.run(rest.x, t, commanded(command))
    cut = np.unique(np.concatenate([t, np.linspace(0, 20e-3, 60)]))
    rows = np.searchsorted(t, cut[:-1], side="right") - 1
    pieces = fine.run(rest.x, cut, commanded(command[rows]))
    assert whole.x.shape == (6, plant.n)
    assert scaled_error(plant, pieces.x[np.searchsorted(cut, t)], whole.x) < 1e-6
    assert np.array_equal(whole.x[0], rest.x)


def test_advance_is_one_hold_and_observe_one_row(plant, engine, rest, commanded):
    (u,) = commanded([0.3])
    after = engine.advance(rest.x, u, 2e-3)
    assert scaled_error(plant, after, engine.run(rest.x, np.array([0, 2e-3]), u[None]).x[1]) < 1e-4
    np.testing.assert_allclose(engine.observe(after, u), plant.observe(after, u)[0], rtol=1e-12, atol=1e-12)


def test_a_run_is_a_function_of_its_arguments(plant, engine, rest, commanded):
    t = np.arange(101) * 1e-3
    u, x0, p = commanded(0.3 * np.sin(50 * t)), rest.x.copy(), plant.parameter_values(M=700.0)
    first = engine.run(x0, t, u, p)
    engine.run(x0, t, -3 * u)
    engine.run(x0 * np.nan, t, u)
    engine.advance(first.x[50], u[3], 7e-4)
    again = engine.run(x0, t, u, p)
    assert np.array_equal(first.x, again.x)
    assert first.attempts == again.attempts
    assert np.array_equal(first.x, Engine(plant).run(x0, t, u, p).x)
    assert np.array_equal(x0, rest.x)
    assert not np.array_equal(first.x, engine.run(x0, t, u).x)


def test_advance_is_a_function_of_its_arguments(plant, engine, rest, commanded):
    (u,) = commanded([0.3])
    start = engine.run(rest.x, np.arange(11) * 1e-3, np.tile(u, (10, 1))).x[-1]
    first = engine.advance(start, u, 1e-3)
    engine.run(rest.x, np.arange(30) * 1e-3, np.tile(u, (30, 1)))
    engine.advance(rest.x * np.nan, u, 1e-3)
    assert np.array_equal(first, engine.advance(start, u, 1e-3))
    assert np.array_equal(first, Engine(plant).advance(start, u, 1e-3))


FAILURES = {
    "a parameter that is not a number": {"p": {"M": np.nan}},
    "no mass": {"p": {"M": 0.0}},
    "a negative bulk modulus": {"p": {"beta": -1e9}},
    "no volume": {"p": {"Vo2": 0.0}},
    "a state that is not a number": {"x": np.nan},
    "an infinite state": {"x": np.inf},
    "an input that is not a number": {"u": np.nan},
    "an infinite force": {"u": np.inf},
}


@pytest.mark.parametrize("what", FAILURES)
def test_what_can_not_be_integrated_is_flagged(plant, engine, rest, commanded, what):
    """Never raised, never silent: NaN from where it failed on, and the time of it."""
    change = FAILURES[what]
    x, t, u = rest.x.copy(), np.arange(31) * 1e-3, commanded(np.full(31, 0.1))
    row = 0
    if "x" in change:
        x[plant.state("v")] = change["x"]
    if "u" in change:
        row = 20
        u[row, plant.input("disturbance")] = change["u"]
    run = engine.run(x, t, u, plant.parameter_values(**change.get("p", {})))
    assert not run.ok
    assert run.failed_at == t[row]
    assert np.all(np.isfinite(run.x[1 : row + 1]))
    assert np.all(np.isnan(run.x[row + 1 :]))
    assert engine.advance(x, u[row], 1e-3, plant.parameter_values(**change.get("p", {}))) is None
    assert engine.run(rest.x, t, commanded(np.zeros(31))).ok  # and the engine goes on


# numbers of the plant, drawn as powers of ten about the rig's own
WILD = (
    "Ps",
    "beta",
    "M",
    "b",
    "Cl",
    "K3",
    "eps",
    "Kp",
    "Km",
    "psi2",
    "psi3",
    "V0",
    "Vo2",
    "Vo3",
    "J",
    "Kr2",
    "Aj",
    "K1",
)


@settings(max_examples=60)
@given(
    powers=st.lists(st.floats(-2, 2), min_size=len(WILD), max_size=len(WILD)),
    command=st.lists(st.floats(-1.5, 1.5), min_size=4, max_size=4),
    extra=st.tuples(st.floats(-0.2, 0.2), st.floats(-3, 3), st.floats(-3e5, 3e5), st.sampled_from([0.0, 1e6, 1e8])),
)
def test_random_plants_are_finite_or_flagged(plant, engine, rest, commanded, powers, command, extra):
    numbers = dict(zip(WILD, powers, strict=True))
    values = {name: plant.p[plant.parameters.index(name)] * 10**power for name, power in numbers.items()}
    t, u = np.linspace(0, 8e-3, 5), commanded(command)
    u[:, 1:] = extra[:3]
    run = engine.run(rest.x, t, u, plant.parameter_values(**values, ks=extra[3]))
    reached = len(t) if run.failed_at is None else int(np.searchsorted(t, run.failed_at)) + 1
    assert np.all(np.isfinite(run.x[:reached]))
    assert np.all(np.isnan(run.x[reached:]))


@pytest.mark.parametrize("times", [[0.0, 2e-3, 1e-3], [0.0, 1e-3, 1e-3], [0.0, np.nan, 1e-3], [0.0, 1e-3, np.inf]])
def test_times_that_do_not_grow_are_refused(engine, rest, commanded, times):
    with pytest.raises(ValueError, match="jack-10t: times must be finite and increasing"):
        engine.run(rest.x, np.array(times), commanded([0.3, 0.3]))


def test_with_no_time_left_an_attempt_changes_nothing(plant, rest, commanded):
    state = np.array([*rest.x, 0.0, 1e-5, 7.0])
    after = adaptive_attempt(plant)(state, commanded([0.5])[0], plant.p, 1e-5)
    assert np.array_equal(np.array(after).ravel(), state)


@st.composite
def systems(draw):
    """A sparse matrix dominated by its diagonal, by rows, and a right-hand side."""
    n = draw(st.integers(1, 12))
    value = st.floats(-1, 1)
    dense = np.array([[draw(value) if draw(st.booleans()) else 0.0 for _ in range(n)] for _ in range(n)])
    np.fill_diagonal(dense, 0.0)
    signs = np.array([draw(st.sampled_from([-1.0, 1.0])) for _ in range(n)])
    return dense + np.diag(signs * (np.abs(dense).sum(axis=1) + 0.1)), np.array([draw(value) for _ in range(n)])


@given(systems())
def test_sparse_lu_solves_as_numpy_does(system):
    dense, right = system
    pattern = ca.sparsify(ca.DM(dense)).sparsity()
    matrix, column = ca.SX.sym("a", pattern), ca.SX.sym("b", len(right))
    solve = ca.Function("solve", [matrix, column], [SparseLU(matrix).solve(column)])
    found = np.array(solve(ca.DM(pattern, dense[tuple(np.array(pattern.get_triplet()))]), right)).ravel()
    assert found == pytest.approx(np.linalg.solve(dense, right), rel=1e-9, abs=1e-9)


@given(systems())
def test_the_elimination_order_is_a_permutation(system):
    dense, _ = system
    order = markowitz_order([set(np.flatnonzero(row)) for row in dense])
    assert sorted(order) == list(range(len(dense)))


def test_an_arrow_is_eliminated_from_its_tips():
    """The full row and column wait until nothing would fill in."""
    order = markowitz_order([set(range(6)), *({0, i} for i in range(1, 6))])
    assert order.index(0) >= 4


def test_a_trajectory_gives_its_signals_by_name_with_units(plant, engine, rest, commanded, monkeypatch):
    t, u = np.arange(4) * 1e-3, commanded(np.array([0.1, 0.2, 0.3]))
    run = engine.run(rest.x, t, u)
    expected = plant.observe(run.x, np.vstack((u, u[-1:])))
    for column, name in enumerate(plant.outputs):
        assert np.array_equal(run[name], expected[:, column])
    assert np.array_equal(run["P1"], run.x[:, plant.state("P1")])
    assert run["command"].tolist() == [0.1, 0.2, 0.3, 0.3]
    assert (run.units["position"], run.units["P1"], run.units["command"]) == ("m", "Pa", "1")
    assert repr(run).startswith("<Trajectory of jack-10t: 0 to 0.003 s, 4 rows, ")
    assert repr(engine).startswith("<Engine of jack-10t: ")
    with pytest.raises(KeyError, match='no signal of jack-10t "positon"; did you mean "position"'):
        run["positon"]
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=dict))
    frame = run.to_pandas()
    assert next(iter(frame)) == "t [s]"
    assert np.array_equal(frame["position [m]"], run["position"])
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pandas is not installed"):
        run.to_pandas()
