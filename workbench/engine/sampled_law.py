"""A sampled law inside the compiled run of a plant: what happens at each sampling instant, as one graph.

At an instant the sensors are read, the law demands a command, the guard limits it or trips, the drive holds what has
arrived. The law is a pair of graphs, with its numbers as parameters, so that other gains, rigs, limits and noise need
no other machine code. The law does not learn of a command that is added to its own. loop/sampled_loop.py runs the same
instants in Python and is the oracle in tests.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Protocol

import casadi as ca

from ..plant import Plant
from . import object_cache
from .codegen import gathered_inputs
from .emit import emit
from .guard_rules import let_through, packed_state, parts, watched
from .guard_shape import GuardShape, length, places
from .instant import Parts, held, reading
from .jobs import Frame
from .lanes import Code
from .tape import divide_less, opcodes, read

OUT = ("sent", "demanded", "held", "trip")  # what every instant puts out, before the recorded outputs


class InstantShape(Protocol):
    """What decides the machine code of the instants of one law or of several; it can be hashed."""

    @property
    def state(self) -> Mapping[str, slice]:
        """Places in the state of an instant: the commands that the drives hold last come first."""
        ...

    @property
    def width_out(self) -> int:
        """How many numbers an instant puts out."""
        ...

    def instant(self, plant: Plant) -> ca.Function:
        """(x, u, p, state, row, numbers) -> (inputs of the plant, state after, what is put out), one after another."""
        ...


class LawGraphs:
    """A law: output (x, (r, y), o, q) -> u, and advance (x, (r, y), v, o, q) -> x+.

    v is the command that the drive really got, o the constant that starts a loop without a bump, q the law's numbers.
    Two of them are the same where their graphs are.
    """

    def __init__(self, output: ca.Function, advance: ca.Function) -> None:
        self.output, self.advance = output, advance
        self._text = output.serialize() + advance.serialize()

    @property
    def states(self) -> int:
        """How many."""
        return self.output.size1_in(0)

    @property
    def numbers(self) -> int:
        """How many."""
        return self.output.size1_in(3)

    @property
    def calls(self) -> bool:
        """Whether it calls a kernel, which is in machine code only."""
        return "call" in opcodes(self.output)

    @cached_property
    def slopes(self) -> ca.Function:
        """(x, (r, y), v, o, q) -> df/dx, df/d(r, y), dg/dx, dg/d(r, y), df/dv, df/do, dg/do of advance f and output
        g."""
        symbols, slopes = self._slopes
        return ca.Function("slopes", list(symbols), [ca.densify(slope) for slope in slopes])

    @cached_property
    def linear(self) -> bool:
        """Whether the slopes are the same everywhere."""
        if self.calls:
            return False
        symbols, slopes = self._slopes
        return not ca.depends_on(ca.veccat(*slopes), ca.vertcat(*symbols[:4]))

    @cached_property
    def _slopes(self) -> tuple[tuple[ca.SX, ...], tuple[ca.SX, ...]]:
        """x, (r, y), v, o and q, and the slopes."""
        x, s, v, o, q = symbols = tuple(ca.SX.sym("i", self.advance.size1_in(i)) for i in range(5))
        u, after = self.output(x, s, o, q), self.advance(x, s, v, o, q)
        pairs = (after, x), (after, s), (u, x), (u, s), (after, v), (after, o), (u, o)
        return symbols, tuple(ca.jacobian(y, of) for y, of in pairs)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LawGraphs) and self._text == other._text

    def __hash__(self) -> int:
        return hash(self._text)

    def __repr__(self) -> str:
        return f"<LawGraphs of {self.states} states, {self.numbers} numbers>"


@dataclass(frozen=True)
class LawShape:
    """What decides the machine code of an instant; everything else is a parameter.

    graphs: the law's. measured: the outputs that it sees. sensors: all of the rig's, in the order of their noise.
    ahead: how many samples ahead it knows its reference. late: whole periods that a command is on its way, and with
    `split` a part of one more, over which the drive holds the older command, or `interpolated` the mean. own_delays:
    each lane has a delay of its own of up to so many whole periods. noisy: sensors have noise and resolution. recorded:
    outputs put out.
    """

    graphs: LawGraphs
    measured: tuple[str, ...]
    sensors: tuple[str, ...]
    guard: GuardShape
    ahead: int = 0
    late: int = 0
    split: bool = False
    interpolated: bool = False
    own_delays: bool = False
    noisy: bool = False
    recorded: tuple[str, ...] = ()

    @property
    def read(self) -> tuple[str, ...]:
        """The outputs that are read: those that the law or the guard needs."""
        return self.guard.read

    @property
    def state(self) -> dict[str, slice]:
        """Places in the state of an instant: the command that the drive holds last, those on their way, ..."""
        return places(held=1, line=self.late + 1, command=1, guard=length(self.guard.state), law=self.graphs.states)

    @property
    def width_out(self) -> int:
        """How many numbers an instant puts out."""
        return len(OUT) + len(self.recorded)

    def instant(self, plant: Plant) -> ca.Function:
        """The graph of an instant."""
        return instant(plant, self)

    @property
    def trip(self) -> int:
        """Place of the number of a trip in the state."""
        return self.state["guard"].start + self.guard.state["trip"].start

    @property
    def numbers(self) -> dict[str, slice]:
        """Places of the parameters."""
        sensors = len(self.read)
        guard = {name: place.stop - place.start for name, place in self.guard.numbers.items()}
        taps = {"taps": self.late + 1} if self.own_delays else {}
        own = {"q": self.graphs.numbers, "offset": 1}
        return places(**own, **guard, part=1, **taps, noise=sensors, resolution=sensors)

    def inputs(self, plant: Plant) -> dict[str, slice]:
        """Places in the row of an instant: the reference and those to come, added command, the plant's inputs but for
        the command, noise."""
        return places(
            reference=1 + self.ahead,
            added=1,
            others=len(plant.inputs) - 1,
            noise=len(self.sensors) if self.noisy else 0,
        )


def instant(plant: Plant, shape: LawShape) -> ca.Function:
    """(x, u, p, state, row, numbers) -> (inputs of the plant, state after, what is put out), one after the other."""
    x, u, p = (ca.SX.sym(*args) for args in (("x", plant.n), ("u", len(plant.inputs)), ("p", len(plant.parameters))))
    vectors = (shape.state, shape.inputs(plant), shape.numbers)
    state, row, numbers = (ca.SX.sym(name, length(of)) for name, of in zip(("s", "r", "q"), vectors, strict=True))
    s, r, q = (parts(vector, of) for vector, of in zip((state, row, numbers), vectors, strict=True))
    outputs = plant.h(x, ca.vertcat(s["held"], r["others"]), p)
    signals = {name: outputs[plant.output(name)] for name in shape.read}
    law = _law(shape, s, r, q, _readings(shape, signals, r, q))
    now, last, line = _arriving(shape, s["line"], law["sent"], q)
    after = ca.vertcat(last, line, law["sent"], law["guard"], law["state"])
    put_out = [law["sent"], law["demanded"], now, law["trip"]]
    put_out += [outputs[plant.output(name)] for name in shape.recorded]
    arguments = [x, u, p, state, row, numbers]
    return ca.Function("instant", arguments, [ca.cse(ca.vertcat(now, r["others"], after, *put_out))])


def controller_instant(shape: LawShape) -> ca.Function:
    """(state, row, numbers) -> (state after, sent, demanded, trip): an instant of law and guard alone, whose readings
    come from outside. A row is the reference and those to come, the added command, and the readings of `shape.read`."""
    vectors = (shape.state, places(reference=1 + shape.ahead, added=1, readings=len(shape.read)), shape.numbers)
    state, row, numbers = (ca.SX.sym(name, length(of)) for name, of in zip("srq", vectors, strict=True))
    s, r, q = (parts(vector, of) for vector, of in zip((state, row, numbers), vectors, strict=True))
    law = _law(shape, s, r, q, {name: r["readings"][i] for i, name in enumerate(shape.read)})
    kept = {name: s[name] for name in shape.state} | {
        "held": law["sent"], "command": law["sent"], "guard": law["guard"], "law": law["state"]
    }  # fmt: skip
    after = ca.vertcat(*(kept[name] for name in shape.state), law["sent"], law["demanded"], law["trip"])
    return ca.Function("controller", [state, row, numbers], [ca.cse(after)])


def _readings(shape: LawShape, signals: Parts, r: Parts, q: Parts) -> Parts:
    """What the sensors say that law or guard reads."""
    if not shape.noisy:
        return signals
    noise = {name: r["noise"][shape.sensors.index(name)] for name in shape.read}
    return {
        name: reading(signals[name], q["noise"][i] * noise[name], q["resolution"][i])
        for i, name in enumerate(shape.read)
    }


def _law(shape: LawShape, s: Parts, r: Parts, q: Parts, readings: Parts) -> dict[str, ca.SX]:
    """The command that the guard lets through, what was demanded, the trip, and the law's state after."""
    signals = ca.vertcat(r["reference"], *(readings[name] for name in shape.measured))
    guard = parts(s["guard"], shape.guard.state)
    guard = watched(shape.guard, guard, ca.vertcat(*readings.values()), s["command"], r["reference"][0], q)
    demanded = ca.SX(shape.graphs.output(s["law"], signals, q["offset"], q["q"]))
    asked = ca.if_else(guard["trip"] > 0, 0, demanded + r["added"])
    sent, trip = let_through(guard, asked, s["command"], q)
    advanced = ca.SX(shape.graphs.advance(s["law"], signals, sent - r["added"], q["offset"], q["q"]))
    return {
        "sent": sent,
        "demanded": asked,
        "trip": trip,
        "guard": packed_state(shape.guard, guard | {"trip": trip}),
        "state": ca.if_else(trip > 0, s["law"], advanced),
    }


def _arriving(shape: LawShape, line: ca.SX, sent: ca.SX, q: Parts) -> tuple[ca.SX, ca.SX, ca.SX]:
    """What the drive holds from now on, what at the period's end, and the commands on their way (as DelayLine)."""
    line = ca.vertcat(line, sent)
    before, now = line[0], line[1]
    if shape.own_delays:  # the oldest command comes first
        taps = q["taps"][::-1]
        before, now = ca.dot(taps, line[:-1]), ca.dot(taps, line[1:])
    return *held(shape, before, now, q["part"]), line[1:]


@dataclass(frozen=True)
class SampledLaw:
    """Machine code of a plant's sampling instants, `sample`: for one lane and for blocks of lanes."""

    single: object_cache.Library
    block: object_cache.Library


def compile_law(plant: Plant, shape: InstantShape) -> SampledLaw:
    """Machine code for a law of this shape on a plant, from the cache where it has been compiled before.

    Raises OSError or RuntimeError where this machine cannot compile.
    """
    graph, fused = shape.instant(plant), object_cache.fused()
    libraries = []
    for width in (1, object_cache.vector_width()):
        key = ("sample", graph.serialize(), str(width), str(fused), str(shape))
        write = partial(_module, graph, plant, shape, width, fused)
        libraries.append(object_cache.load(key, write, ("sample",)))
    return SampledLaw(*libraries)


def compile_controller(shape: LawShape) -> object_cache.Library:
    """Machine code `controller(law, row, numbers, out)` of a law and its guard: the state at `law` changes in place,
    `out` gets the command sent, the one demanded, and the trip.

    Raises OSError or RuntimeError where this machine cannot compile.
    """
    graph, fused = controller_instant(shape), object_cache.fused()
    key = ("controller", graph.serialize(), str(fused), str(shape))
    return object_cache.load(key, partial(_controller_module, graph, shape, fused), ("controller",))


def _controller_module(graph: ca.Function, shape: LawShape, fused: bool) -> str:
    """IR of `controller`."""
    tape, code, states = divide_less(read(graph), {2}), Code(1, fused), length(shape.state)
    sources: dict[int, Callable[[int], str]] = {
        argument: (lambda e, name=name: f"ptr %{name}, i64 {e}")
        for argument, name in enumerate(("law", "row", "numbers"))
    }
    values = emit(code, tape, [node for _, node in tape.results], gathered_inputs(code, tape, sources))
    for element, node in tape.results:
        target = f"ptr %law, i64 {element}" if element < states else f"ptr %out, i64 {element - states}"
        code.write(f"store double {values[node]}, ptr {code.do(f'getelementptr double, {target}')}")
    head = "define void @controller(ptr %law, ptr %row, ptr %numbers, ptr %out) nounwind {"
    return "\n".join([head, "entry:", *code.lines, "  ret void", "}", *sorted(code.declared)])


def _module(graph: ca.Function, plant: Plant, shape: InstantShape, width: int, fused: bool) -> str:
    """IR of `sample(slot, law, row, numbers, out)` for one lane of a block of `width`."""
    tape, code = divide_less(read(graph), {2, 5}), Code(1, fused)
    frame = Frame(width, plant.n, len(plant.inputs), len(plant.parameters), 0).places
    sources: dict[int, Callable[[int], str]] = {
        argument: (lambda e, first=frame[name]: f"ptr %slot, i64 {first + e * width}")
        for argument, name in enumerate("xup")
    }
    for argument, name in ((3, "law"), (4, "row"), (5, "numbers")):
        sources[argument] = lambda e, name=name: f"ptr %{name}, i64 {e}"
    values = emit(code, tape, [node for _, node in tape.results], gathered_inputs(code, tape, sources))
    inputs, states = len(plant.inputs), length(shape.state)
    for element, node in tape.results:
        target = f"ptr %slot, i64 {frame['u'] + element * width}"
        if element >= inputs + states:
            target = f"ptr %out, i64 {element - inputs - states}"
        elif element >= inputs:
            target = f"ptr %law, i64 {element - inputs}"
        code.write(f"store double {values[node]}, ptr {code.do(f'getelementptr double, {target}')}")
    head = "define void @sample(ptr %slot, ptr %law, ptr %row, ptr %numbers, ptr %out) nounwind {"
    return "\n".join([head, "entry:", *code.lines, "  ret void", "}", *sorted(code.declared)])
