"""Sampled linear laws as data: the form in which a law runs compiled, in batches and, merged, sample by sample.

    u = C x + D (r, y) + o            the demanded command
    x+ = A x + B (r, y) + E (v - o)   knowing the command v that the drive really got

E holds the anti-windup or the observer's knowledge of the drive; o is the constant that starts a loop without a bump.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..linear.interconnect import select, series
from ..linear.state_space import StateSpace

Start = Callable[[np.ndarray, float], tuple[np.ndarray, float]]


@dataclass(frozen=True)
class LaneStart:
    """A Start that is written for lanes: ((r, y) [lanes, 1 + m], commands [lanes]) -> (x [lanes, n], o [lanes])."""

    lanes: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

    def __call__(self, signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
        x, offset = self.lanes(signals[None], np.array([command]))
        return x[0], float(offset[0])


def starts(start: Start, signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Any Start in lanes, one after another where it is not written for them."""
    if isinstance(start, LaneStart):
        return start.lanes(signals, commands)
    pairs = [start(s, u) for s, u in zip(signals, commands.tolist(), strict=True)]
    return np.array([x for x, _ in pairs]), np.array([offset for _, offset in pairs])


@dataclass(frozen=True)
class LinearLaw:
    """A law's numbers, SI: a [n, n], b [n, 1 + m], c [n], d [1 + m], e [n], of the reference and m `measures`.

    start: ((r, y) [1 + m], command) -> (x [n], o) with which the next demanded command is `command`.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    e: np.ndarray
    measures: tuple[str, ...]
    start: Start

    @property
    def states(self) -> int:
        """How many."""
        return len(self.a)

    def picked(self, reference: float, measurement: Mapping[str, float]) -> np.ndarray:
        """(r, y) [1 + m] out of signals by name."""
        return np.array([reference, *(measurement[name] for name in self.measures)])


def resting(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> Start:
    """The start of a law without integrators: its states rest at the signals, o makes up the command."""

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = _settled(a, b, signals)
        return x, np.array([u - c @ w - d @ s for u, w, s in zip(commands, x, signals, strict=True)])

    return LaneStart(lanes)


def _settled(a: np.ndarray, b: np.ndarray, signals: np.ndarray) -> np.ndarray:
    """States [lanes, n] that stay as they are under inputs [lanes, m]."""
    entering = np.array([b @ s for s in signals]).T
    return np.ascontiguousarray(np.linalg.solve(np.eye(len(a)) - a, entering).T)


def static(gains: Sequence[float], measures: tuple[str, ...]) -> LinearLaw:
    """u = gains . (r, y) + o: a law without states."""
    a, b, c, d = np.zeros((0, 0)), np.zeros((0, len(gains))), np.zeros(0), np.asarray(gains, float)
    return LinearLaw(a, b, c, d, np.zeros(0), measures, resting(a, b, c, d))


def realised_as_demanded(law: LinearLaw, period: float) -> StateSpace:
    """The law where the drive does what is demanded (v = u): reference and measures -> "command", each period [s]."""
    a, b = law.a + np.outer(law.e, law.c), law.b + np.outer(law.e, law.d)
    return StateSpace(a, b, law.c[None], law.d[None], period, ["reference", *law.measures], ["command"])


def with_command_filter(inner: LinearLaw, filtered: StateSpace) -> LinearLaw:
    """A law with the output of a stable filter added to its command.

    The inner law learns the command of the drive less what was added.
    """
    law = _system(inner, filtered.dt)
    summed = replace(
        law,
        B=np.column_stack((law.B, -inner.e)),
        D=np.column_stack((law.D, 1.0)),
        input_labels=[*law.input_labels, "added"],
    )
    own, heard = places(inner.measures, filtered)

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w, added = at_rest(filtered, signals[:, heard])
        x, offset = starts(inner.start, signals[:, own], commands - added)
        return np.hstack((x, w)), offset

    return _composed(inner, series(filtered.relabelled(filtered.input_labels, ["added"]), summed), LaneStart(lanes))


def with_reference_filter(inner: LinearLaw, filtered: StateSpace) -> LinearLaw:
    """A law whose reference is the output of a stable filter."""
    leading = filtered.relabelled(filtered.input_labels, ["reference"])
    own, heard = places(inner.measures, filtered)

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w, references = at_rest(filtered, signals[:, heard])
        x, offset = starts(inner.start, np.column_stack((references, signals[:, own[1:]])), commands)
        return np.hstack((x, w)), offset

    return _composed(inner, series(leading, _system(inner, filtered.dt)), LaneStart(lanes))


def on_load_cell(inner: LinearLaw, stiffness: float) -> LinearLaw:
    """A law of position on a load cell: its position is force over stiffness [N/m]."""
    scale = np.ones(len(inner.d))
    scale[1] = 1 / stiffness

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return starts(inner.start, signals * scale, commands)

    start = LaneStart(lanes)
    return LinearLaw(inner.a, inner.b * scale, inner.c, inner.d * scale, inner.e, ("force", *inner.measures[1:]), start)


def _system(law: LinearLaw, period: float) -> StateSpace:
    """The law without what it learns of the drive, for `interconnect`."""
    return StateSpace(law.a, law.b, law.c[None], law.d[None], period, ["reference", *law.measures], ["command"])


def _composed(inner: LinearLaw, whole: StateSpace, start: Start) -> LinearLaw:
    """Inner law and filter in series as data; states: the inner law's, then the filter's."""
    measures = [name for name in whole.input_labels if name not in ("reference", *inner.measures)]
    law = select(whole, ["reference", *inner.measures, *measures], ["command"])
    e = np.append(inner.e, np.zeros(len(law.A) - inner.states))
    return LinearLaw(law.A, law.B, law.C[0], law.D[0], e, (*inner.measures, *measures), start)


def at_rest(filtered: StateSpace, signals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States [lanes, k] that stay as they are under inputs [lanes, m], and the outputs [lanes]."""
    w, c, d = _settled(filtered.A, filtered.B, signals), filtered.C[0], filtered.D[0]
    return w, np.array([c @ x + d @ s for x, s in zip(w, signals, strict=True)])


def signals_of(measures: tuple[str, ...], filtered: StateSpace) -> list[str]:
    """The inputs of a law and a filter: the reference, the law's measures, then what only the filter takes."""
    return list(dict.fromkeys(("reference", *measures, *filtered.input_labels)))


def places(measures: tuple[str, ...], filtered: StateSpace) -> tuple[list[int], list[int]]:
    """Where the inputs of a law and those of a filter are among the signals of both."""
    signals = signals_of(measures, filtered)
    own = [signals.index(name) for name in ("reference", *measures)]
    return own, [signals.index(name) for name in filtered.input_labels]
