"""Machine code against CasADi's interpreter: every operation, whole runs, bad lanes, and what falls back."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from workbench.engine import emit, object_cache, rosenbrock
from workbench.engine.compiled import CompiledPlant
from workbench.engine.engine import NotCompiled, Stepping, back_end_of, compile_plant
from workbench.engine.vector_math import LIBM
from workbench.plant import Plant, build
from workbench.rigs.rig_file import load_rig

STEPPING = Stepping(tolerance=1e-5, first_step=2e-5, cap=20_000)
PERIOD = 5e-4
BACK_ENDS = ("compiled", "interpreted")

UNARY = {
    "neg": lambda x: -x,
    "exp": ca.exp,
    "log": ca.log,
    "sqrt": ca.sqrt,
    "sq": lambda x: x * x,
    "twice": lambda x: 2 * x,
    "inv": lambda x: 1 / x,
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": ca.tan,
    "asin": ca.asin,
    "acos": ca.acos,
    "atan": ca.atan,
    "floor": ca.floor,
    "ceil": ca.ceil,
    "fabs": ca.fabs,
    "sign": ca.sign,
    "erf": ca.erf,
    "sinh": ca.sinh,
    "cosh": ca.cosh,
    "tanh": ca.tanh,
    "asinh": ca.asinh,
    "acosh": ca.acosh,
    "atanh": ca.atanh,
    "log1p": ca.log1p,
    "expm1": ca.expm1,
    "not": ca.logic_not,
    "constpow": lambda x: ca.constpow(x, -1 / 3),
}
BINARY = {
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
    "pow": lambda x, y: x**y,
    "lt": lambda x, y: x < y,
    "le": lambda x, y: x <= y,
    "eq": lambda x, y: x == y,
    "ne": lambda x, y: x != y,
    "and": ca.logic_and,
    "or": ca.logic_or,
    "fmod": ca.fmod,
    "copysign": ca.copysign,
    "fmin": ca.fmin,
    "fmax": ca.fmax,
    "atan2": ca.atan2,
    "hypot": ca.hypot,
    "remainder": ca.remainder,
    "if_else_zero": lambda x, y: ca.if_else(x, y, 0),
}
COARSE = {**dict.fromkeys(LIBM, 1), "tanh": 3, **dict.fromkeys(["pow", "constpow", "exp", "log", "sin", "cos"], 2)}
EDGES = [0.0, 5e-324, 2e-310, 1e-300, 0.5, 1.0, 1.5, 2.0, 700.0, 709.78, 709.79, 745.2, 1e10, 1e300, np.inf]
EDGES += [np.pi / 2, np.pi, 1e5 * np.pi, 2.0**20, 2.0**21, np.nextafter(1, 0), np.nextafter(1, 2), 3.0, 1 / 3]


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Leave the user's cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def jack() -> Plant:
    return build(load_rig("jack-10t"))


@pytest.fixture(scope="module")
def compiled(jack: Plant) -> CompiledPlant:
    return compile_plant(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, STEPPING)


def still(n: int, m: int, k: int) -> ca.Function:
    """An attempt that does nothing."""
    s, left = ca.SX.sym("s", n + 3), 0
    after = ca.vertcat(s[:n], left, s[n + 1 :])
    return ca.Function("still", [s, ca.SX.sym("u", m), ca.SX.sym("p", k), ca.SX.sym("tolerance")], [after])


def compile_outputs(expressions: list[ca.SX], arguments: list[ca.SX]) -> tuple[CompiledPlant, ca.Function]:
    """Expressions of x [n] as the outputs of a plant with one unused input and parameter."""
    x, u, p = ca.vertcat(*arguments), ca.SX.sym("u"), ca.SX.sym("p")
    h = ca.Function("h", [x, u, p], [ca.vertcat(*expressions)])
    return compile_plant(still(x.numel(), 1, 1), h, np.zeros(1), STEPPING), h


def numbers() -> np.ndarray:
    """Edges of both signs, NaN, and spread values of every magnitude that a plant may meet."""
    rng = np.random.default_rng(1)
    wide = rng.standard_normal(3000) * 10.0 ** rng.uniform(-12, 12, 3000)
    near = np.concatenate([rng.uniform(-50, 50, 3000), rng.uniform(-1, 1, 3000), rng.uniform(0.5, 2, 1000)])
    return np.concatenate([EDGES, np.negative(EDGES), [np.nan], wide, near])


def check(names: list[str], ours: np.ndarray, theirs: np.ndarray) -> None:
    """Equal to the units in the last place of COARSE, with NaN and infinity where CasADi has them."""
    for name, a, b in zip(names, ours.T, theirs.T, strict=True):
        with np.errstate(invalid="ignore", over="ignore"):
            near = np.abs(a - b) <= COARSE.get(name, 0) * np.spacing(np.abs(b))
        flushed = (a == 0) & (np.abs(b) < 5e-308) if name == "exp" else False
        wrong = ~(near | (a == b) | (np.isnan(a) & np.isnan(b)) | flushed)
        assert not wrong.any(), f"{name}: {a[wrong][:3]} instead of {b[wrong][:3]}"


@pytest.fixture(params=[(1, True), (4, True), (8, True), (4, False)], ids="{0[0]} lanes, fused {0[1]}".format)
def processor(request, monkeypatch) -> None:
    """Other widths than this machine's own, and one that cannot multiply and add at once."""
    width, fused = request.param
    has = object_cache.fused()
    monkeypatch.setattr(object_cache, "vector_width", lambda: width)
    monkeypatch.setattr(object_cache, "fused", lambda: has and fused)


@pytest.mark.usefixtures("processor")
def test_every_unary_operation_agrees_with_casadi() -> None:
    x = ca.SX.sym("x")
    plant, h = compile_outputs([law(x) for law in UNARY.values()], [x])
    values = numbers()[:, None]
    expected = np.array(h(values.T, 0, 0)).T
    ours = plant.outputs(values, np.zeros(1), np.zeros(1))
    check(list(UNARY), ours, expected)


@pytest.mark.usefixtures("processor")
def test_every_binary_operation_agrees_with_casadi() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    plant, h = compile_outputs([law(x, y) for law in BINARY.values()], [x, y])
    edges = np.concatenate([EDGES, np.negative(EDGES), [np.nan], np.arange(-3.0, 4.0)])
    rng = np.random.default_rng(2)
    pairs = np.concatenate(
        [
            np.stack(np.meshgrid(edges, edges), -1).reshape(-1, 2),
            np.stack([10.0 ** rng.uniform(-20, 20, 5000), rng.uniform(-14, 14, 5000)], -1),
            rng.standard_normal((5000, 2)),
        ]
    )
    expected = np.array(h(pairs.T, 0, 0)).T
    check(list(BINARY), plant.outputs(pairs, np.zeros(1), np.zeros(1)), expected)


def test_no_supported_operation_is_left_untested() -> None:
    x = ca.SX.sym("x")
    assert (emit.SUPPORTED - {"input", "output", "const", "assign", "real", "select"}) == UNARY.keys() | BINARY.keys()
    for name, law in UNARY.items():
        assert name in emit.opcodes(ca.Function("f", [x], [law(x)])), name


def test_if_else_discards_the_branch_not_taken() -> None:
    x = ca.SX.sym("x")
    plant, _ = compile_outputs([ca.if_else(x > 0, ca.log(x), ca.sqrt(-x)), ca.fmax(ca.log(x), -1)], [x])
    y = plant.outputs(np.array([[-4.0], [1.0]]), np.zeros(1), np.zeros(1))
    assert np.array_equal(y, [[2, -1], [0, 0]])


def interpreted(plant: Plant, x0: np.ndarray, t: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, int]:
    """The same run by CasADi, call by call; NaN from the interval that fails."""
    attempt = rosenbrock.adaptive_attempt(plant)
    states, step, used, n = np.full((len(t), plant.n), np.nan), STEPPING.first_step, 0, plant.n
    states[0] = x0
    for j, duration in enumerate(np.diff(t)):
        s = np.concatenate([states[j], [duration, step, 0]])
        while s[n] > 0:
            s = np.array(attempt(s, u[j], p, STEPPING.tolerance)).ravel()
            if s[n] > 0 and rosenbrock.failed(s[n + 1]):
                return states, used + int(s[n + 2])
        states[j + 1], step, used = s[:n], s[n + 1], used + int(s[n + 2])
    return states, used


def command(plant: Plant, rows: int, seed: int = 0) -> np.ndarray:
    """Held inputs that move every valve: a sine with noise on it."""
    u = np.zeros((rows, len(plant.inputs)))
    noise = np.random.default_rng(seed).standard_normal(rows)
    u[:, 0] = 0.3 * np.sin(0.2 * np.arange(rows)) + 0.02 * noise
    return u


@pytest.mark.parametrize("rig", ["jack-10t", "jack-10t-rounded", "festo-tp511"])
def test_a_run_equals_the_interpreters_to_rounding(rig: str) -> None:
    plant = build(load_rig(rig))
    machine = compile_plant(rosenbrock.adaptive_attempt(plant), plant.h, plant.p, STEPPING)
    t, u = PERIOD * np.arange(61), command(plant, 60)
    expected, used = interpreted(plant, plant.start, t, u, plant.p)
    batch = machine.run_batch(plant.start[None], t, u)
    assert batch.ok[0]
    assert batch.attempts[0] == used
    assert np.max(np.abs(batch.x[0] - expected) / plant.scale) < 1e-11


def lanes_of(plant: Plant, lanes: int, rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Initial states, inputs and parameters that differ from lane to lane."""
    rng = np.random.default_rng(3)
    x0 = plant.start + 0.01 * plant.scale * rng.standard_normal((lanes, plant.n))
    u = np.stack([command(plant, rows, seed) for seed in range(lanes)])
    return x0, u, plant.p * rng.uniform(0.95, 1.05, (lanes, len(plant.p)))


@pytest.mark.parametrize(("rig", "width"), [("jack-10t", 4), ("festo-tp511", 8)])
def test_lanes_agree_with_single_runs_bit_for_bit(rig: str, width: int, monkeypatch) -> None:
    monkeypatch.setattr(object_cache, "vector_width", lambda: width)
    plant = build(load_rig(rig))
    compiled = compile_plant(rosenbrock.adaptive_attempt(plant), plant.h, plant.p, STEPPING)
    lanes, rows = 4 * width + 3, 40
    t, (x0, u, p) = PERIOD * np.arange(rows + 1), lanes_of(plant, lanes, rows)
    batch = compiled.run_batch(x0, t, u, p)
    assert batch.ok.all()
    for i in range(lanes):
        alone = compiled.run_batch(x0[i : i + 1], t, u[i], p[i])
        assert alone.x.tobytes() == batch.x[i].tobytes()
        assert alone.attempts[0] == batch.attempts[i]
    before = np.concatenate([u[:, :1], u], axis=1)
    y = compiled.outputs(batch.x, before, p[:, None])
    assert y[-1, -1].tobytes() == compiled.observe(batch.x[-1, -1], u[-1, -1], p[-1]).tobytes()
    assert y[:, :1].tobytes() == compiled.outputs(batch.x[:, :1], before[:, :1], p[:, None]).tobytes()
    assert np.allclose(y[2], plant.observe(batch.x[2], before[2], p[2]), rtol=1e-12, atol=1e-12 * np.abs(y[2]).max(0))


def test_a_brief_plant_gives_the_same_numbers_bit_for_bit(jack: Plant, compiled: CompiledPlant, monkeypatch) -> None:
    t, (x0, u, p) = PERIOD * np.arange(13), lanes_of(jack, 9, 12)
    whole = compiled.run_batch(x0, t, u, p)
    brief = compile_plant(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, STEPPING, brief=True)
    monkeypatch.setattr(object_cache, "compiled", lambda _: False)
    monkeypatch.setattr(object_cache, "load", lambda *_: pytest.fail("a brief plant compiles no block"))
    assert brief.run_batch(x0, t, u, p).x.tobytes() == whole.x.tobytes()
    y = brief.outputs(whole.x[:, 1:], u, p[:, None])
    assert y.tobytes() == compiled.outputs(whole.x[:, 1:], u, p[:, None]).tobytes()


def test_a_brief_plant_takes_the_block_that_is_there(jack: Plant, compiled: CompiledPlant, monkeypatch) -> None:
    t, (x0, u, p) = PERIOD * np.arange(13), lanes_of(jack, 9, 12)
    whole = compiled.run_batch(x0, t, u, p)
    brief = compile_plant(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, STEPPING, brief=True)
    monkeypatch.setattr(object_cache, "store", lambda *_: pytest.fail("it was compiled before"))
    assert brief._block is not brief._single
    assert brief.run_batch(x0, t, u, p).x.tobytes() == whole.x.tobytes()


@pytest.mark.parametrize("batches", [True, False], ids=["a block", "one lane of a long plant"])
def test_a_brief_plant_is_compiled_in_haste_to_the_same_bits(
    jack: Plant, compiled: CompiledPlant, monkeypatch, batches: bool
) -> None:
    t, (x0, u, p) = PERIOD * np.arange(13), lanes_of(jack, 9, 12)
    whole, how, compiler = compiled.run_batch(x0, t, u, p), [], object_cache._compile
    monkeypatch.setattr(object_cache, "compiled", lambda _: False)
    monkeypatch.setattr(object_cache, "_compile", lambda ir, *asked: how.append(asked) or compiler(ir, *asked))
    monkeypatch.setattr("workbench.engine.compiled._LONG", 1000)
    brief = compile_plant(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, STEPPING, brief=True, batches=batches)
    for lanes in (9, 1):
        assert brief.run_batch(x0[:lanes], t, u[:lanes], p[:lanes]).x.tobytes() == whole.x[:lanes].tobytes()
    assert how == [(False, True)]


def test_a_lane_that_fails_is_marked_and_its_neighbours_are_untouched(jack: Plant, compiled: CompiledPlant) -> None:
    rows = 12
    t, (x0, u, p) = PERIOD * np.arange(rows + 1), lanes_of(jack, 9, rows)
    good = compiled.run_batch(x0, t, u, p)
    broken = u.copy()
    broken[2, 5] = np.nan
    ill = p.copy()
    ill[6] = np.nan
    bad = compiled.run_batch(x0, t, broken, ill)
    assert bad.failed.tolist() == [-1, -1, 5, -1, -1, -1, 0, -1, -1]
    assert bad.x[2, :6].tobytes() == good.x[2, :6].tobytes()
    assert np.isnan(bad.x[2, 6:]).all()
    assert np.isnan(bad.x[6, 1:]).all()
    assert bad.x[bad.ok].tobytes() == good.x[bad.ok].tobytes()


def test_the_cap_on_attempts_marks_a_lane(jack: Plant) -> None:
    few = compile_plant(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, Stepping(1e-5, 2e-5, 3))
    batch = few.run_batch(jack.start[None], PERIOD * np.arange(4), command(jack, 3))
    assert batch.failed[0] == 0
    assert batch.attempts[0] == 3


def test_a_run_of_too_many_attempts_for_its_time_is_given_up(jack: Plant) -> None:
    """At the first moment at which they are more than a burst and so many a second, whatever runs it."""
    few = Stepping(1e-5, 2e-5, 20_000, rate=1000.0, burst=20.0)
    t, u = PERIOD * np.arange(401), command(jack, 400)
    whole = compile_plant(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, STEPPING)
    runs = {name: back_end_of(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, few, name)[0] for name in BACK_ENDS}
    batches = {name: run.run_batch(np.tile(jack.start, (2, 1)), t, u) for name, run in runs.items()}
    used = [whole.run_batch(jack.start[None], t[: k + 1], u[:k]).attempts[0] for k in range(1, 60)]
    first = next(k for k, attempts in enumerate(used) if attempts > few.burst + few.rate * t[k + 1])
    for batch in batches.values():
        assert batch.failed.tolist() == [first] * 2
        assert few.spent(int(batch.attempts[0]), t[first + 1])
        assert np.isfinite(batch.x[0, : first + 1]).all()
    assert not few.spent(used[first - 1], t[first])


@pytest.mark.skipif(sys.platform == "win32", reason="a signal to a process of its own is POSIX")
def test_an_interrupt_is_heard_inside_a_long_run(jack: Plant) -> None:
    """Stopped within a fraction of what it would take, and the next run is whole."""
    compiled = compile_plant(rosenbrock.adaptive_attempt(jack), jack.h, jack.p, STEPPING)
    rows = 2_000_000
    t, u = PERIOD * np.arange(rows + 1), np.tile(command(jack, 1000), (rows // 1000, 1))
    before = time.process_time()
    alarm = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt):
            compiled.run_batch(jack.start[None], t, u)
    finally:
        signal.signal(signal.SIGALRM, alarm)
    assert time.process_time() - before < 1.5
    assert compiled.run_batch(jack.start[None], t[:101], u).ok.all()


def test_the_loop_goes_the_same_way_as_a_batch_of_one_period(jack: Plant, compiled: CompiledPlant) -> None:
    x0, u, p = lanes_of(jack, 7, 1)
    after, failed = compiled.advance_batch(x0, u[:, 0], PERIOD, p)
    assert not failed.any()
    for i in range(7):
        alone = compiled.advance(x0[i], u[i, 0], PERIOD, p[i])
        assert alone is not None
        assert alone.tobytes() == after[i].tobytes()
    assert compiled.advance(np.full(jack.n, np.nan), u[0, 0], PERIOD) is None
    after, failed = compiled.advance_batch(np.where(np.arange(7)[:, None] == 3, np.nan, x0), u[:, 0], PERIOD)
    assert failed.tolist() == [i == 3 for i in range(7)]


def test_rows_can_be_left_out(jack: Plant, compiled: CompiledPlant) -> None:
    t, u = PERIOD * np.arange(8), command(jack, 7)
    x0 = np.tile(jack.start, (5, 1))
    every, third = compiled.run_batch(x0, t, u), compiled.run_batch(x0, t, u, every=3)
    assert third.x.tobytes() == every.x[:, ::3].tobytes()
    assert np.array_equal(compiled.run_batch(x0, t[:1], u).x[:, 0], x0)


def test_threads_share_a_batch_without_a_trace(jack: Plant, compiled: CompiledPlant, monkeypatch) -> None:
    t, (x0, u, p) = PERIOD * np.arange(101), lanes_of(jack, 40, 100)
    many = compiled.run_batch(x0, t, u, p)
    monkeypatch.setattr("workbench.engine.compiled.cores", lambda: 1)
    assert compiled.run_batch(x0, t, u, p).x.tobytes() == many.x.tobytes()


def test_arguments_that_do_not_fit_are_refused(jack: Plant, compiled: CompiledPlant) -> None:
    t, u, x0 = PERIOD * np.arange(4), command(jack, 3), jack.start[None]
    for arguments in [(x0[:, 1:], t, u), (x0, t, u[:2]), (x0, t, u[:, 1:]), (x0, t, u, jack.p[1:]), (x0, -t, u)]:
        with pytest.raises(ValueError, match=r"shapes|increasing"):
            compiled.run_batch(*arguments)
    with pytest.raises(ValueError, match="expected"):
        compiled.outputs(jack.start, u[0])


def test_an_unsupported_operation_is_named() -> None:
    x = ca.SX.sym("x")
    with pytest.raises(NotCompiled, match="erfinv"):
        compile_outputs([ca.erfinv(x)], [x])


def test_without_llvmlite_the_reason_is_given(monkeypatch) -> None:
    for name in ("compiled", "object_cache"):
        monkeypatch.delitem(sys.modules, f"workbench.engine.{name}")
        monkeypatch.delattr(f"workbench.engine.{name}")
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    x = ca.SX.sym("x")
    with pytest.raises(NotCompiled, match="llvmlite"):
        compile_outputs([x], [x])


@pytest.mark.parametrize(
    ("room", "heavy"),
    [
        ("rigs", "casadi"),
        ("engine", "llvmlite scipy.stats scipy.signal control matplotlib pyarrow"),
        ("linear", "llvmlite scipy.stats scipy.signal control matplotlib pyarrow"),
        ("commands.fit.study", "scipy.stats scipy.signal control matplotlib"),
        ("commands.trace.study", "scipy.stats scipy.signal control matplotlib"),
    ],
)
def test_a_room_imports_no_more_than_it_needs(room: str, heavy: str) -> None:
    code = f"import sys, workbench.{room}; print([name for name in {heavy.split()} if name in sys.modules])"
    root = Path(__file__).parent.parent
    assert subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True).stdout == "[]\n"


def test_outputs_of_no_rows_are_none(plant, engine):
    nothing = np.zeros((0, plant.n)), np.zeros((0, len(plant.inputs)))
    assert engine.outputs(*nothing).shape == (0, len(plant.outputs))
