"""Sampled laws that are not linear, as graphs: they run compiled, and are linear about any operating point.

    u = g(x, (r, y), o, q)            the demanded command
    x+ = f(x, (r, y), v, o, q)        knowing the command v that the drive really got

Their numbers q are parameters: other numbers need no new compilation.
"""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np

from ..engine.sampled_law import LawGraphs
from ..linear.state_space import StateSpace
from .linear_law import LaneStart, LinearLaw, Start, at_rest, places, signals_of, starts
from .piecewise_linear import CommandMap, PiecewiseLinear

Output = Callable[[ca.SX, ca.SX, ca.SX, ca.SX], ca.SX]
Advance = Callable[[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX], ca.SX]
Settled = Callable[[np.ndarray, Mapping[str, float]], np.ndarray]


def _as_it_is(x: np.ndarray, _: Mapping[str, float]) -> np.ndarray:
    return x


@dataclass(frozen=True, eq=False)
class GraphLaw:
    """Graphs of a law, its `numbers` q [k] and the signals that it `measures`, the controlled one first.

    start: ((r, y) [1 + m], command) -> (x [n], o) with which the next demanded command is `command`.
    settled: (x [n], operating point) -> x [n] once what the law measures slowly has arrived there: for linear views.
    view: the law whose slopes are the linear view of one that switches between samples.
    fallbacks: the place in x that counts the samples in which a solver did not arrive.
    memory: the places in x of what the law has measured of its plant, and keeps while it stands.
    """

    graphs: LawGraphs
    numbers: np.ndarray
    measures: tuple[str, ...]
    start: Start
    settled: Settled = _as_it_is
    view: "GraphLaw | None" = None
    fallbacks: int | None = None
    memory: tuple[int, ...] = ()

    @classmethod
    def of(
        cls,
        output: Output,
        advance: Advance,
        numbers: np.ndarray,
        measures: tuple[str, ...],
        states: int,
        start: Start,
        key: Hashable = None,
    ) -> "GraphLaw":
        """A law of two functions on symbols: output(x, (r, y), o, q) and advance(x, (r, y), v, o, q).

        A `key` is all that these functions depend on: laws of one key share their graphs, which take milliseconds.
        """
        sizes = states, 1 + len(measures), len(numbers)
        graphs = _graphs(output, advance, sizes) if key is None else _shared_graphs(_Keyed(key, output, advance), sizes)
        return cls(graphs, np.asarray(numbers, float), measures, start)

    @property
    def states(self) -> int:
        """How many."""
        return self.graphs.states

    def picked(self, reference: float, measurement: Mapping[str, float]) -> np.ndarray:
        """(r, y) [1 + m] out of signals by name."""
        return np.array([reference, *(measurement[name] for name in self.measures)])

    def linearised(self, at: Mapping[str, float]) -> LinearLaw:
        """The law of small deviations where it rests at an operating point: signals and command by name."""
        if self.view is not None:
            return self.view.linearised(at)
        signals, command = self.picked(at[self.measures[0]], at), at["command"]
        x, offset = self._resting(signals, at)
        a, b, c, d, e = (np.array(part) for part in self.graphs.slopes(x, signals, command, offset, self.numbers))

        def start(_: np.ndarray, command: float) -> tuple[np.ndarray, float]:
            return x, command

        return LinearLaw(a, b, c[0], d[0], e[:, 0], self.measures, start)

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
        x, offset = starts(self.start, signals, commands)
        x = np.array([self.settled(own, at) for own, at in zip(x, every, strict=True)])
        if remembered is not None:
            x[:, list(self.memory)] = remembered
        lanes, n, m = len(commands), self.states, signals.shape[1]
        columns = (x.reshape(lanes, n).T, signals.T, commands[None], offset[None], np.tile(self.numbers, (lanes, 1)).T)
        slopes = [np.array(part) for part in self.graphs.slopes(*columns)]
        a, b, c, d, e = (
            part.reshape(len(part), lanes, width).transpose(1, 0, 2)
            for part, width in zip(slopes, (n, m, n, m, 1), strict=True)
        )
        return [a + e @ c, b + e @ d, c[:, 0], d[:, 0]]

    def _resting(self, signals: np.ndarray, at: Mapping[str, float]) -> tuple[np.ndarray, float]:
        x, offset = self.start(signals, at["command"])
        return self.settled(x, at), offset


@dataclass(frozen=True)
class _Keyed:
    """Two functions on symbols that are known by a key."""

    key: Hashable
    output: Output = field(compare=False)
    advance: Advance = field(compare=False)


@lru_cache(maxsize=256)
def _shared_graphs(functions: _Keyed, sizes: tuple[int, int, int]) -> LawGraphs:
    return _graphs(functions.output, functions.advance, sizes)


def _graphs(output: Output, advance: Advance, sizes: tuple[int, int, int]) -> LawGraphs:
    x, s, v, o, q = _symbols(*sizes)
    return LawGraphs(
        ca.Function("output", [x, s, o, q], [output(x, s, o, q)]),
        ca.Function("advance", [x, s, v, o, q], [ca.densify(advance(x, s, v, o, q))]),
    )


class GraphController:
    """A controller whose law is a graph: the base of classes that write one, and nothing else, down."""

    def __init__(self, law: GraphLaw) -> None:
        self._law, self.measures = law, law.measures
        self._x, self._offset = law.start(np.zeros(1 + len(law.measures)), 0.0)
        self._signals = np.zeros(1 + len(law.measures))

    @property
    def state(self) -> np.ndarray:
        """The graph's state [n] now."""
        return self._x

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump."""
        self._x, self._offset = self._law.start(self._law.picked(reference, measurement), command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The command of the graph."""
        self._signals = self._law.picked(reference, measurement)
        return float(self._law.graphs.output(self._x, self._signals, self._offset, self._law.numbers))

    def update(self, realised: float) -> None:
        """The states of the graph, one period on."""
        law = self._law
        after = law.graphs.advance(self._x, self._signals, realised, self._offset, law.numbers)
        self._x = np.array(after).ravel()

    def graph_law(self) -> GraphLaw:
        """The law."""
        return self._law


def as_graph(law: LinearLaw | GraphLaw) -> GraphLaw:
    """A linear law as a graph of its numbers."""
    if isinstance(law, GraphLaw):
        return law
    n, m = law.states, len(law.d)
    numbers = np.concatenate([np.ravel(part) for part in (law.a, law.b, law.c, law.d, law.e)])

    def parts(q: ca.SX) -> tuple[ca.SX, ...]:
        a, b, c, d, e = ca.vertsplit(q, np.cumsum([0, n * n, n * m, n, m, n]).tolist())
        return ca.reshape(a, n, n).T, ca.reshape(b, m, n).T, c, d, e

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        return ca.dot(parts(q)[2], x) + ca.dot(parts(q)[3], s) + o

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        a, b, _, _, e = parts(q)
        return a @ x + b @ s + e * (v - o)

    return GraphLaw.of(output, advance, numbers, law.measures, n, law.start, ("linear", n, m))


def with_filter(
    inner: GraphLaw, filtered: StateSpace, into_reference: bool, schedule: PiecewiseLinear | None = None
) -> GraphLaw:
    """A law with the output of a stable filter as its reference, or added to its command.

    A `schedule` of the measured position is a factor of that output.
    """
    signals, (own, heard) = signals_of(inner.measures, filtered), places(inner.measures, filtered)
    if schedule is not None and "position" not in signals:
        signals.append("position")
    split = np.cumsum([0, len(inner.numbers), *(part.size for part in filtered.matrices)]).tolist()
    tables = () if schedule is None else (schedule.at, schedule.values)
    numbers = np.concatenate([inner.numbers, *(part.ravel() for part in filtered.matrices), *tables])
    n, k, place = inner.states, len(filtered.A), signals.index("position") if schedule else 0

    def seen(x: ca.SX, s: ca.SX, q: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
        """The inner law's signals, what is added to its command, and the filter's state after."""
        a, b, c, d = (q[first:last] for first, last in pairwise(split[1:]))
        w, u = x[n:], s[heard]
        out = ca.dot(c, w) + ca.dot(d, u)
        if schedule is not None:
            half = (numbers.size - split[-1]) // 2
            out *= interpolated(q[split[-1] : split[-1] + half], q[split[-1] + half :], s[place])
        after = ca.reshape(a, k, k).T @ w + ca.reshape(b, len(heard), k).T @ u
        return (ca.vertcat(out, s[own[1:]]), ca.SX(0), after) if into_reference else (s[own], out, after)

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        taken, added, _ = seen(x, s, q)
        return ca.SX(inner.graphs.output(x[:n], taken, o, q[: split[1]])) + added

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        taken, added, after = seen(x, s, q)
        return ca.vertcat(ca.SX(inner.graphs.advance(x[:n], taken, v - added, o, q[: split[1]])), after)

    def lanes(at: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w, out = at_rest(filtered, at[:, heard])
        out = out * schedule.over(at[:, place]) if schedule else out
        taken = np.column_stack((out, at[:, own[1:]])) if into_reference else at[:, own]
        x, offset = starts(inner.start, taken, commands if into_reference else commands - out)
        return np.hstack((x, w)), offset

    def settled(x: np.ndarray, at: Mapping[str, float]) -> np.ndarray:
        return np.append(inner.settled(x[:n], at), x[n:])

    key = "filter", inner.graphs, k, tuple(own), tuple(heard), place, numbers.size, into_reference, schedule is None
    law = GraphLaw.of(output, advance, numbers, tuple(signals[1:]), n + k, LaneStart(lanes), key)
    view = inner.view and with_filter(inner.view, filtered, into_reference, schedule)
    return replace(law, settled=settled, view=view, fallbacks=inner.fallbacks, memory=inner.memory)


def of_scaled(inner: GraphLaw, signal: str, factor: float) -> GraphLaw:
    """A law whose controlled signal is another one times a factor."""
    split = len(inner.numbers)
    scale = np.ones(1 + len(inner.measures))
    scale[1] = factor

    def scaled(s: ca.SX, q: ca.SX) -> ca.SX:
        return ca.vertcat(s[0], s[1] * q[split], s[2:])

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        return ca.SX(inner.graphs.output(x, scaled(s, q), o, q[:split]))

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        return ca.SX(inner.graphs.advance(x, scaled(s, q), v, o, q[:split]))

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return starts(inner.start, signals * scale, commands)

    start, measures = LaneStart(lanes), (signal, *inner.measures[1:])
    key = "scaled", inner.graphs
    law = GraphLaw.of(output, advance, np.append(inner.numbers, factor), measures, inner.states, start, key)
    view = inner.view and of_scaled(inner.view, signal, factor)
    return replace(law, view=view, fallbacks=inner.fallbacks, memory=inner.memory)


def with_command_map(inner: GraphLaw, command_map: CommandMap) -> GraphLaw:
    """A law whose command goes through a static map; it learns the realised command mapped back."""
    first, points = len(inner.numbers), len(command_map.at)
    numbers = np.concatenate((inner.numbers, command_map.at, command_map.to))

    def tables(q: ca.SX) -> tuple[ca.SX, ca.SX]:
        return q[first : first + points], q[first + points :]

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        (at, to), u = tables(q), ca.SX(inner.graphs.output(x, s, o, q[:first]))
        return u + interpolated(at, to - at, u)

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        at, to = tables(q)
        return ca.SX(inner.graphs.advance(x, s, v + interpolated(to, at - to, v), o, q[:first]))

    back = command_map.back

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return starts(inner.start, signals, commands + back.over(commands))

    key = "map", inner.graphs, points
    law = GraphLaw.of(output, advance, numbers, inner.measures, inner.states, LaneStart(lanes), key)
    view = inner.view and with_command_map(inner.view, command_map)
    return replace(law, settled=inner.settled, view=view, fallbacks=inner.fallbacks, memory=inner.memory)


def with_sine(inner: GraphLaw, amplitude: float, turn: np.ndarray) -> GraphLaw:
    """A law with a sine on top of its command, from 0 at the start; it learns the realised command less that. `turn`
    [2, 2] takes (sine, cosine) to the next sample. Its linear view is that of the law."""
    n, first = inner.states, len(inner.numbers)
    numbers = np.concatenate((inner.numbers, turn.ravel()))

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        return ca.SX(inner.graphs.output(x[:n], s, o, q[:first])) + x[n]

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        own = ca.SX(inner.graphs.advance(x[:n], s, v - x[n], o, q[:first]))
        return ca.vertcat(own, ca.reshape(q[first:], 2, 2).T @ x[n:])

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, offset = starts(inner.start, signals, commands)
        return np.hstack((x, np.tile([0.0, amplitude], (len(commands), 1)))), offset

    key = "sine", inner.graphs
    law = GraphLaw.of(output, advance, numbers, inner.measures, n + 2, LaneStart(lanes), key)
    return replace(law, view=inner.view or inner, fallbacks=inner.fallbacks, memory=inner.memory)


def interpolated(at: ca.SX, values: ca.SX, x: ca.SX) -> ca.SX:
    """Values [k] at increasing points [k], linear between them, held beyond: as PiecewiseLinear.

    A sum of bends, so that the slope at a point is that of one of its sides: rounding decides at most which.
    """
    slopes = (values[1:] - values[:-1]) / (at[1:] - at[:-1])
    bends = ca.vertcat(slopes, 0) - ca.vertcat(0, slopes)
    return values[0] + ca.dot(bends, ca.fmax(x - at, 0))


def _symbols(states: int, signals: int, numbers: int) -> tuple[ca.SX, ...]:
    """x, (r, y), v, o, q."""
    sizes = {"x": states, "s": signals, "v": 1, "o": 1, "q": numbers}
    return tuple(ca.SX.sym(name, size) for name, size in sizes.items())
