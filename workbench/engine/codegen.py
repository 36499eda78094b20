"""LLVM IR for a plant: what every lane computes in an attempt, and outputs. driver.py has the loop around it."""

from collections.abc import Callable
from functools import partial

import casadi as ca

from .driver import run, service
from .emit import emit
from .jobs import Frame, OutputJob, RunJob, structure
from .lanes import Code
from .scalars import Scalars
from .tape import Tape, divide_less, fixed, read

_SMALLEST_STEP = 1e-12  # s: as in rosenbrock.failed


def module(attempt: ca.Function, outputs: ca.Function, width: int, fused: bool, commands: int = 1) -> str:
    """IR of `run` for an attempt (s, u, p, tolerance) -> s, and of `outputs` for (x, u, p) -> y."""
    tape = divide_less(read(attempt), {2, 3})
    constants = _constants(tape)
    sizes = attempt.numel_in(0) - 3, attempt.numel_in(1), attempt.numel_in(2)
    frame = Frame(width, *sizes, len(constants), commands)
    prepare, step, observe = (Code(width, fused, label) for label in ("entry", "entry", "block"))
    lines = [
        f"%run_job = type {structure(RunJob)}",
        f"%output_job = type {structure(OutputJob)}",
        *_prepare(prepare, tape, frame, constants),
        *_attempt(step, tape, frame, constants),
        *service(frame),
        *run(frame),
        *_outputs(observe, outputs),
    ]
    return "\n".join([*lines, *sorted(prepare.declared | step.declared | observe.declared)])


def _constants(tape: Tape) -> list[int]:
    """Nodes that depend on parameters alone and that others use: they are computed once a run."""
    flags = fixed(tape, {2, 3})
    used = {a for i, node in enumerate(tape.nodes) if not flags[i] for a in node.args}.union(r for _, r in tape.results)
    return [i for i in sorted(used) if flags[i] and tape.nodes[i].op not in ("const", "input")]


def _prepare(code: Code, tape: Tape, frame: Frame, constants: list[int]) -> list[str]:
    values = emit(code, tape, constants, _inputs(code, tape, frame))
    for i, node in enumerate(constants):
        _store(code, values[node], frame.places["prepared"] + i * frame.width)
    return ["define internal void @prepare(ptr %frame) noinline nounwind {", "entry:", *code.lines, "  ret void", "}"]


def _attempt(code: Code, tape: Tape, frame: Frame, constants: list[int]) -> list[str]:
    """One attempt of every lane; returns a bit for each lane that wants service: at its end, too short or too long."""
    places, width = frame.places, frame.width
    given = _inputs(code, tape, frame)
    given |= {node: partial(_load, code, places["prepared"] + i * width) for i, node in enumerate(constants)}
    values = emit(code, tape, [node for _, node in tape.results], given)
    after = {element: values[node] for element, node in tape.results}
    left, step, attempts = (after[frame.n + i] for i in range(3))
    over = code.compare("ole", left, code.number(0.0))
    failed = code.compare("ule", step, code.number(_SMALLEST_STEP))
    capped = code.compare("oge", attempts, _load(code, places["limit"]))
    waiting = code.bits_of(code.logic("or", over, code.logic("or", failed, capped)))
    for element, value in after.items():
        _store(code, value, element * width)
    head = "define internal i64 @attempt(ptr %frame) noinline nounwind {"
    return [head, "entry:", *code.lines, f"  ret i64 {waiting}", "}"]


def _inputs(code: Code, tape: Tape, frame: Frame) -> dict[int, Callable[[], str]]:
    """Loaders of the input nodes of an attempt."""
    first = [frame.places[name] for name in ("x", "u", "p", "tolerance")]
    return {i: partial(_load, code, first[a] + e * frame.width) for i, (a, e) in _arguments(tape).items()}


def gathered_inputs(code: Code, tape: Tape, sources: dict[int, Callable[[int], str]]) -> dict[int, Callable[[], str]]:
    """Loaders of the input nodes of a tape: `sources` gives the address of an element of each argument."""

    def load(address: str) -> str:
        return code.do(f"load double, ptr {code.do(f'getelementptr double, {address}')}")

    return {i: partial(load, sources[a](e)) for i, (a, e) in _arguments(tape).items()}


def _arguments(tape: Tape) -> dict[int, tuple[int, int]]:
    return {i: node.value for i, node in enumerate(tape.nodes) if isinstance(node.value, tuple)}


def _load(code: Code, element: int) -> str:
    address = code.do(f"getelementptr i64, ptr %frame, i64 {element}")
    return code.do(f"load {code.type}, ptr {address}")


def _store(code: Code, value: str, element: int) -> None:
    address = code.do(f"getelementptr i64, ptr %frame, i64 {element}")
    code.write(f"store {code.type} {value}, ptr {address}")


def _outputs(code: Code, outputs: ca.Function) -> list[str]:
    """`outputs`: y = h(x, u, p), one row of a trajectory a lane; the last row fills up the last block."""
    tape = divide_less(read(outputs), {2})
    b = Scalars(OutputJob, "%output_job")
    rows, count = _rows(b, code.width, outputs)
    given = {i: partial(_gather, code, rows[a], e) for i, (a, e) in _arguments(tape).items()}
    values = emit(code, tape, [node for _, node in tape.results], given)
    for element, node in tape.results:
        for w, row in enumerate(rows[3]):
            lane = code.do(f"extractelement {code.type} {values[node]}, i32 {w}") if code.width > 1 else values[node]
            code.write(f"store double {lane}, ptr {code.do(f'getelementptr double, ptr {row}, i64 {element}')}")
    return [
        "define void @outputs(ptr %job) nounwind {",
        "entry:",
        "  br label %take",
        "take:",
        *b.lines,
        *code.lines,
        "  br label %last",
        "last:",
        f"  %after = add i64 %row, {code.width}",
        f"  %more = icmp slt i64 %after, {count}",
        "  br i1 %more, label %block, label %take",
        "done:",
        "  ret void",
        "}",
    ]


def _rows(b: Scalars, width: int, outputs: ca.Function) -> tuple[list[list[str]], str]:
    """Begins the blocks `lane` and `block`; addresses of x, u, p and y of each row of a block, and how many rows."""
    lane, some = b.take()
    b.branch(some, "lane", "done")
    b.write("lane:")
    count = b.get("rows")
    sizes = {"x": outputs.numel_in(0), "u": b.get("u_row"), "p": b.get("p_row"), "y": outputs.numel_out(0)}
    first = b.integer("mul", lane, count)
    bases = {name: b.at(b.get(name), b.integer("mul", first, sizes[name])) for name in "xy"}
    bases |= {name: b.at(b.get(name), b.integer("mul", lane, b.get(f"{name}_lane"))) for name in "up"}
    last = b.integer("sub", count, 1)
    b.write("br label %block")
    b.write("block:")
    b.write("%row = phi i64 [0, %lane], [%after, %last]")
    addresses: list[list[str]] = [[], [], [], []]
    for w in range(width):
        row = b.integer("add", "%row", w)
        row = b.do(f"select i1 {b.do(f'icmp slt i64 {row}, {last}')}, i64 {row}, i64 {last}")
        for of, name in zip(addresses, "xupy", strict=True):
            of.append(b.at(bases[name], b.integer("mul", row, sizes[name])))
    return addresses, count


def _gather(code: Code, rows: list[str], element: int) -> str:
    """One element of each row, as a vector."""
    vector = "undef"
    for w, row in enumerate(rows):
        value = code.do(f"load double, ptr {code.do(f'getelementptr double, ptr {row}, i64 {element}')}")
        if code.width == 1:
            return value
        vector = code.do(f"insertelement {code.type} {vector}, double {value}, i32 {w}")
    return vector
