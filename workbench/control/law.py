"""The one form of a control law: two graphs, a start without a bump, and numbers.

    u = g(x, s, o, q)            the demanded command [1] of this sample
    x+ = f(x, s, v, o, q)        the state after it, knowing the command v that the drive really got
    (x, o) = start(s, u)         with which the next demanded command is u

x is the state, s = (reference, measured signals), with the references to come in front of the signals where the law
knows them ahead; o is the constant that starts a loop without a bump, q are numbers, which need no new compilation.
From a law are made: the controller that Python asks (`LawController`), lanes and compiled loops (`dense`, engine's
sampled_law), slopes at any operating point (`linearised`), and code for a card (export/).
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.recent import Recent
from ..engine import lazy_casadi as ca
from ..linear.state_space import StateSpace

if TYPE_CHECKING:
    from ..engine.buffered import BufferedFunction
    from ..engine.sampled_law import LawGraphs
    from .planned_law import PlannedLaw
    from .shell import Shell

_STATES = 4  # linear laws are filled up to a multiple of so many states, so that they share their machine code
_SAME = 1e-9  # of the largest slope

Output = Callable[..., Any]
Settled = Callable[[np.ndarray, Mapping[str, float]], np.ndarray]
Beginning = Callable[[Any, Any], tuple[Any, Any]]


def _as_it_is(x: np.ndarray, _: Mapping[str, float]) -> np.ndarray:
    return x


@dataclass(frozen=True, eq=False)
class Law:
    """A law, sampled every `period` [s]; it `measures` signals, the controlled one first.

    numbers: q [k]. beginning: (s, u) -> (x, o) on symbols, all references alike. names: those of the states. preview:
    how many samples ahead it knows its reference.
    settled: (x [n], operating point) -> x [n] once what the law measures slowly has arrived there: for linear views.
    view: the law whose slopes are the linear view of one that switches between samples, or plans.
    fallbacks: the place in x that counts the samples in which a solver did not arrive.
    memory: the places in x of what the law has measured of its plant, and keeps while it stands.
    inner, shell: of a law within something that stands around it. planned: of a predictive law.
    """

    graphs: "LawGraphs"
    numbers: np.ndarray
    measures: tuple[str, ...]
    period: float
    beginning: Beginning
    names: tuple[str, ...]
    preview: int = 0
    settled: Settled = _as_it_is
    view: "Law | None" = None
    fallbacks: int | None = None
    memory: tuple[int, ...] = ()
    inner: "Law | None" = None
    shell: "Shell | None" = None
    planned: "PlannedLaw | None" = None

    @classmethod
    def of(
        cls,
        command: Output,
        advance: Output,
        start: Beginning,
        *,
        states: Mapping[str, int] | Sequence[str],
        numbers: Mapping[str, Any],
        measures: tuple[str, ...],
        period: float,
        key: Hashable = None,
    ) -> "Law":
        """A law as it stands in a book: command(x, s, o, q) and advance(x, s, v, o, q), whose x, s and q have states,
        signals and numbers by name. `advance` and `start` give states in their order.

        `states`: names, with sizes where they are vectors. A `key` is all that the graphs depend on: laws of one key
        share them.
        """
        sizes = dict(states) if isinstance(states, Mapping) else dict.fromkeys(states, 1)
        values = {name: np.ravel(value) for name, value in numbers.items()}
        widths = {name: value.size for name, value in values.items()}
        signals = dict.fromkeys(("reference", *measures), 1)

        def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
            return command(parted(x, sizes), parted(s, signals), o, parted(q, widths))

        def after(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
            return ca.vertcat(*advance(parted(x, sizes), parted(s, signals), v, o, parted(q, widths)))

        def beginning(s: ca.SX, u: ca.SX) -> tuple[ca.SX, ca.SX]:
            x, offset = start(parted(s, signals), u)
            return ca.vertcat(*x), offset

        every = np.concatenate([np.zeros(0), *values.values()])
        graphs = law_graphs(output, after, (sum(sizes.values()), 1 + len(measures), len(every)), key)
        return cls(graphs, every, measures, period, beginning, flat_names(sizes))

    @property
    def states(self) -> int:
        """How many."""
        return self.graphs.states

    @cached_property
    def start(self) -> "ca.Function":
        """(s [1 + m], u) -> (x, o), all references alike."""
        s, u = ca.SX.sym("s", 1 + len(self.measures)), ca.SX.sym("u")
        x, offset = self.beginning(s, u)
        return ca.Function("start", [s, u], [ca.densify(ca.SX(x)), ca.densify(ca.SX(offset))])

    def starts(self, signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States [lanes, n] and constants [lanes] of signals (r, y) [lanes, 1 + m] and commands [lanes]."""
        x, offset = self.start(signals.T, commands[None])
        return np.array(x).T.reshape(len(commands), self.states), np.array(offset).ravel()

    def picked(self, reference: float, measurement: Mapping[str, float]) -> np.ndarray:
        """(r, y) [1 + m] out of signals by name."""
        return np.array([reference, *(measurement[name] for name in self.measures)])

    @cached_property
    def matrices(self) -> "LinearLaw | None":
        """The numbers of a law that is linear, the same everywhere; None of any other."""
        if self.preview or self.view is not None or not self.graphs.linear:
            return None
        n, m = self.states, 1 + len(self.measures)
        at = np.zeros(n), np.zeros(m), 0.0, 0.0, self.numbers
        a, b, c, d, e, on_state, on_command = (np.array(part) for part in self.graphs.slopes(*at))
        rest = np.array(self.graphs.output(*at[:2], *at[3:])), np.array(self.graphs.advance(*at))
        constant = max(abs(part).max(initial=0.0) for part in (*rest, on_state + e, on_command - 1))
        if constant > _SAME * max(1.0, abs(e).max(initial=0.0)):
            return None
        return LinearLaw(a, b, c.reshape(n), d.reshape(m), e.reshape(n))

    def dense(self, states: int = 0) -> "Law":
        """The law for compiled loops: a linear one by its matrices, filled up, as many linear laws share that graph.

        `states`: as many at least.
        """
        return self if self.matrices is None else _filled(self, -(-max(states, self.states) // _STATES) * _STATES)

    def linearised(self, at: Mapping[str, float]) -> StateSpace:
        """(reference, *measures) -> command of small deviations where the law rests at an operating point, the drive
        doing what is demanded: signals and command by name."""
        a, b, c, d = self.linearised_lanes({name: np.array([value]) for name, value in at.items()})
        names = ["reference", *self.measures]
        return StateSpace(a[0], b[0], c, d, self.period, names, ["command"])

    def linearised_lanes(
        self, points: Mapping[str, np.ndarray], remembered: np.ndarray | None = None
    ) -> list[np.ndarray]:
        """A [lanes, n, n], B [lanes, n, 1 + m], C [lanes, n] and D [lanes, 1 + m], the drive doing what is demanded.

        Where the law rests at operating points: signals and command [lanes] by name. `remembered` [lanes, k]: what it
        has in its `memory` there; without, nothing but what is `settled`.
        """
        if self.view is not None:
            return self.view.linearised_lanes(points, remembered)
        signals = np.stack([points[name] for name in (self.measures[0], *self.measures)], axis=1)
        commands = points["command"]
        every = (dict(zip(points, row, strict=True)) for row in np.stack(list(points.values()), axis=1).tolist())
        x, offset = self.starts(signals, commands)
        x = np.array([self.settled(own, at) for own, at in zip(x, every, strict=True)])
        if remembered is not None:
            x[:, list(self.memory)] = remembered
        lanes, n, m = len(commands), self.states, signals.shape[1]
        columns = (x.reshape(lanes, n).T, signals.T, commands[None], offset[None], np.tile(self.numbers, (lanes, 1)).T)
        slopes = [np.array(part) for part in self.graphs.slopes(*columns)[:5]]
        a, b, c, d, e = (
            part.reshape(len(part), lanes, width).transpose(1, 0, 2)
            for part, width in zip(slopes, (n, m, n, m, 1), strict=True)
        )
        return [a + e @ c, b + e @ d, c[:, 0], d[:, 0]]

    def __repr__(self) -> str:
        return f"<Law of {', '.join(self.measures)}: {self.states} states>"


@dataclass(frozen=True)
class LinearLaw:
    """Numbers of u = c x + d s + o and x+ = a x + b s + e (v - o): a [n, n], b [n, 1 + m], c [n], d [1 + m], e [n]."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    e: np.ndarray

    def view(self, measures: tuple[str, ...], period: float) -> StateSpace:
        """(reference, *measures) -> command where the drive does what is demanded, each `period` [s]."""
        a, b = self.a + np.outer(self.e, self.c), self.b + np.outer(self.e, self.d)
        return StateSpace(a, b, self.c[None], self.d[None], period, ["reference", *measures], ["command"])


def _filled(law: Law, states: int) -> Law:
    """A linear law by its matrices, with further states that are always 0."""
    return _FILLED.get((law, states), lambda: _with_states(law, states))  # each loop of a law asks again


def _with_states(law: Law, states: int) -> Law:
    own, more = law.matrices, (0, states - law.states)
    assert own is not None

    def start(s: ca.SX, u: ca.SX) -> tuple[ca.SX, ca.SX]:
        x, offset = law.start(s, u)
        return ca.vertcat(x, ca.SX.zeros(more[1])), offset

    a, b, c, e = np.pad(own.a, more), np.pad(own.b, (more, (0, 0))), np.pad(own.c, more), np.pad(own.e, more)
    return linear_law(a, b, c, own.d, e, law.measures, law.period, start)


def linear_law(
    a: np.ndarray,
    b: np.ndarray,
    c: np.ndarray,
    d: np.ndarray,
    e: np.ndarray,
    measures: tuple[str, ...],
    period: float,
    start: Beginning | None = None,
    names: tuple[str, ...] = (),
) -> Law:
    """A law of matrices. Without a `start` it has no integrators: its states rest at the signals, o makes up the
    command."""
    n, m = len(a), len(d)
    numbers = np.concatenate([np.ravel(part) for part in (a, b, c, d, e)])

    def parts(q: ca.SX) -> tuple[ca.SX, ...]:
        a, b, c, d, e = ca.vertsplit(q, np.cumsum([0, n * n, n * m, n, m, n]).tolist())
        return ca.reshape(a, n, n).T, ca.reshape(b, m, n).T, c, d, e

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        return ca.dot(parts(q)[2], x) + ca.dot(parts(q)[3], s) + o

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        a, b, _, _, e = parts(q)
        return a @ x + b @ s + e * (v - o)

    graphs = law_graphs(output, advance, (n, m, len(numbers)), ("linear", n, m))
    begin = resting(a, b, c, d) if start is None else start
    return Law(graphs, numbers, measures, period, begin, names or flat_names({"x": n}))


def resting(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> Beginning:
    """The start of a law without integrators: its states rest at the signals, o makes up the command."""
    at_rest = np.linalg.solve(np.eye(len(a)) - a, b)
    through = c @ at_rest + d

    def beginning(s: "ca.SX", u: "ca.SX") -> tuple["ca.SX", "ca.SX"]:
        return ca.DM(at_rest) @ s, u - ca.DM(through).T @ s

    return beginning


def law_of_view(view: StateSpace, measures: tuple[str, ...]) -> Law:
    """A law of a linear view, (reference, *measures) -> command, which takes the drive for doing what is demanded. Its
    states begin at rest at 0, and o makes up the command."""
    a, b, c, d = view.matrices

    def start(s: ca.SX, u: ca.SX) -> tuple[ca.SX, ca.SX]:
        return ca.SX.zeros(len(a)), u - ca.DM(d[0]).T @ s

    return linear_law(a, b, c[0], d[0], np.zeros(len(a)), measures, float(view.dt or 1.0), start)


def static_law(gains: Sequence[float], measures: tuple[str, ...], period: float) -> Law:
    """u = gains . (r, y) + o: a law without states."""
    none = np.zeros(0)
    return linear_law(
        np.zeros((0, 0)), np.zeros((0, len(gains))), none, np.asarray(gains, float), none, measures, period
    )


def law_graphs(output: Output, advance: Output, sizes: tuple[int, int, int], key: Hashable) -> "LawGraphs":
    """Graphs of two functions on symbols, of so many states, signals and numbers; shared by those of one key."""
    make = partial(_graphs, output, advance, sizes)
    return make() if key is None else _SHARED.get((key, sizes), make)


def _graphs(output: Output, advance: Output, sizes: tuple[int, int, int]) -> "LawGraphs":
    from ..engine.sampled_law import LawGraphs

    x, s, q = (ca.SX.sym(name, size) for name, size in zip("xsq", sizes, strict=True))
    v, o = ca.SX.sym("v"), ca.SX.sym("o")
    return LawGraphs(
        ca.Function("output", [x, s, o, q], [ca.densify(ca.SX(output(x, s, o, q)))]),
        ca.Function("advance", [x, s, v, o, q], [ca.densify(ca.SX(advance(x, s, v, o, q)))]),
    )


_ROOM = 100_000  # instructions of graphs, a tenth of a kilobyte each, that stay though nobody holds them


def _size(graphs: "LawGraphs") -> int:
    return max(graphs.instructions, _ROOM // 64)  # so that no more than so many stay


_SHARED: "Recent[tuple[Hashable, tuple[int, int, int]], LawGraphs]" = Recent(_ROOM, _size)
_FILLED: Recent[tuple[Law, int], Law] = Recent(_ROOM, lambda law: _size(law.graphs))


def parted(vector: "ca.SX", sizes: Mapping[str, int]) -> SimpleNamespace:
    """The parts of a vector by name."""
    ends = np.cumsum([0, *sizes.values()]).tolist()
    return SimpleNamespace(**dict(zip(sizes, ca.vertsplit(vector, ends), strict=True)))


def flat_names(sizes: Mapping[str, int]) -> tuple[str, ...]:
    """A name for each number of vectors of such sizes."""
    return tuple(name if size == 1 else f"{name}_{i}" for name, size in sizes.items() for i in range(size))


class LawController:
    """A controller whose law is all that it is: the protocol of workbench.control.protocol, made from the graphs."""

    def __init__(self, law: Law) -> None:
        self._law, self.measures, self.preview = law, law.measures, law.preview
        self._x, self._offset = np.zeros(law.states), 0.0
        self._s, self._future = np.zeros(1 + law.preview + len(law.measures)), np.zeros(0)

    @property
    def state(self) -> np.ndarray:
        """The law's state [n] now, before this period's signals."""
        return self._x

    @property
    def fallbacks(self) -> int | None:
        """In how many periods since `reset` a solver did not arrive; None of a law without one."""
        return None if self._law.fallbacks is None else round(self._x[self._law.fallbacks])

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump."""
        x, offset = self._law.start(self._law.picked(reference, measurement), command)
        self._x, self._offset, self._future = np.array(x).ravel(), float(offset), np.zeros(0)

    def set_preview(self, future: np.ndarray) -> None:
        """The reference now and over the next `preview` samples [preview + 1], before each `compute`."""
        self._future = np.asarray(future, float)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The demanded command [1]."""
        ahead = self._future if len(self._future) else np.full(1 + self.preview, reference)
        s = np.append(ahead, [measurement[name] for name in self.measures])
        whole = self._law.shell is None or np.isfinite(s)  # filters around a law would not forget what is not finite
        self._s = np.where(whole, s, self._s)
        output, _ = self._calls
        return float(output(self._x, self._s, self._offset, self._law.numbers)[0])

    def update(self, realised: float) -> None:
        """The state one period on, knowing the command [1] that the drive really got."""
        _, advance = self._calls
        self._x = advance(self._x, self._s, realised, self._offset, self._law.numbers).copy()

    @cached_property
    def _calls(self) -> "tuple[BufferedFunction, BufferedFunction]":
        """Command and advance."""
        from ..engine.buffered import BufferedFunction

        return BufferedFunction(self._law.graphs.output), BufferedFunction(self._law.graphs.advance)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_calls"}

    def graph_law(self) -> Law:
        """The law."""
        return self._law

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """(reference, *measures) -> command; raises NeedsOperatingPoint for a law that differs between points."""
        from .protocol import law_view

        return law_view(self._law, at)
