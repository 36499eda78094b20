"""The laws of a platform as one graph, with which its loop runs compiled."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import accumulate, pairwise

import casadi as ca
import numpy as np

from ..engine.sampled_law import LawGraphs
from .law import Law
from .piecewise_linear import interpolated
from .platform_controller import LEGS, PlatformController
from .protocol import graph_law

Start = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class PlatformLaw:
    """Graphs output (x, s, o, q) -> u [6] and advance (x, s, v, o, q) -> x+ with their `numbers` q.

    s [12 + 6 m]: references of the legs, feed-forward of the laws, then of each leg what is measured. start: (s,
    commands [6]) -> (x, o [6]) with which the next demanded commands, without feed-forward, are those.
    """

    graphs: LawGraphs
    numbers: np.ndarray
    measures: tuple[str, ...]
    start: Start


@lru_cache(maxsize=32)  # a loop asks at every run
def platform_law(controller: PlatformController) -> PlatformLaw | None:
    """A platform controller's law; None where one of its laws is not a graph."""
    laws = [graph_law(law) for law in controller.laws]
    if any(law is None for law in laws):
        return None
    graphs = [law for law in laws if law is not None]
    whole = _Whole(controller, graphs)
    return PlatformLaw(LawGraphs(*whole.graphs()), whole.numbers, controller.measures, whole.start)


@cache
def direct_law(measures: tuple[str, ...] = ()) -> PlatformLaw:
    """No law: the feed-forward is what is demanded of the jacks, whatever is measured."""
    sizes = {"x": 0, "s": LEGS * (2 + len(measures)), "o": LEGS, "q": 0}
    x, s, o, q = (ca.SX.sym(name, size) for name, size in sizes.items())
    output = ca.Function("output", [x, s, o, q], [s[LEGS : 2 * LEGS]])
    advance = ca.Function("advance", [x, s, ca.SX.sym("v", LEGS), o, q], [x])
    return PlatformLaw(LawGraphs(output, advance), np.zeros(0), measures, _from_nothing)


def _from_nothing(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(0), np.zeros(LEGS)


class _Whole:
    """Six laws side by side: their states, numbers and offsets follow one another."""

    def __init__(self, controller: PlatformController, laws: list[Law]) -> None:
        self._laws, self._measures, self._map = laws, controller.measures, controller.command_map
        self._u = controller.directions
        self._mixes = not np.array_equal(self._u, np.eye(LEGS))
        self._states = list(pairwise(accumulate([law.states for law in laws], initial=0)))
        self._own = list(pairwise(accumulate([len(law.numbers) for law in laws], initial=0)))
        mixing = self._u.ravel() if self._mixes else []
        tables = (self._map.at, self._map.to) if self._map else ()
        self.numbers = np.concatenate([*(law.numbers for law in laws), mixing, *tables])

    def graphs(self) -> tuple[ca.Function, ca.Function]:
        """Output and advance."""
        sizes = {"x": self._states[-1][1], "s": LEGS * (2 + len(self._measures)), "o": LEGS, "q": len(self.numbers)}
        x, s, o, q = (ca.SX.sym(name, size) for name, size in sizes.items())
        v = ca.SX.sym("v", LEGS)
        return (
            ca.Function("output", [x, s, o, q], [ca.cse(self._output(x, s, o, q))]),
            ca.Function("advance", [x, s, v, o, q], [ca.cse(ca.densify(self._advance(x, s, v, o, q)))]),
        )

    def start(self, signals: np.ndarray, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States and offsets."""
        own = self._u.T @ (command if self._map is None else command + self._map.back.over(command))
        mixed = self._u.T @ np.concatenate((signals[:LEGS, None], signals[2 * LEGS :].reshape(LEGS, -1)), axis=1)
        starts = [
            law.starts(row[None, self._places(law)], np.array([v]))
            for law, row, v in zip(self._laws, mixed, own, strict=True)
        ]
        return np.concatenate([x[0] for x, _ in starts]), np.concatenate([offset for _, offset in starts])

    def _output(self, x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        seen = self._seen(s, q)
        v = [
            law.graphs.output(x[slice(*at)], seen[j], o[j], q[slice(*of)])
            for j, (law, at, of) in enumerate(zip(self._laws, self._states, self._own, strict=True))
        ]
        commands = ca.vertcat(*v) + s[LEGS : 2 * LEGS]
        u = self._directions(q) @ commands if self._mixes else commands
        if self._map is None:
            return u
        at, to = self._tables(q)
        return u + ca.vertcat(*(interpolated(at, to - at, u[i]) for i in range(LEGS)))

    def _advance(self, x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        if self._map is not None:
            at, to = self._tables(q)
            v += ca.vertcat(*(interpolated(to, at - to, v[i]) for i in range(LEGS)))
        own, seen = self._directions(q).T @ v if self._mixes else v, self._seen(s, q)
        own -= s[LEGS : 2 * LEGS]
        after = [
            law.graphs.advance(x[slice(*at)], seen[j], own[j], o[j], q[slice(*of)])
            for j, (law, at, of) in enumerate(zip(self._laws, self._states, self._own, strict=True))
        ]
        return ca.vertcat(*after)

    def _seen(self, s: ca.SX, q: ca.SX) -> list[ca.SX]:
        """(r, y) of each law."""
        legs = ca.horzcat(s[:LEGS], ca.reshape(s[2 * LEGS :], len(self._measures), LEGS).T)
        mixed = self._directions(q).T @ legs if self._mixes else legs
        return [mixed[j, self._places(law)].T for j, law in enumerate(self._laws)]

    def _places(self, law: Law) -> list[int]:
        return [0, *(1 + self._measures.index(name) for name in law.measures)]

    def _directions(self, q: ca.SX) -> ca.SX:
        first = self._own[-1][1]
        return ca.reshape(q[first : first + LEGS * LEGS], LEGS, LEGS).T

    def _tables(self, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        points = len(self._map.at) if self._map else 0
        return q[-2 * points : -points], q[-points:]
