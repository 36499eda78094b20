"""Sampled linear laws as data: the form in which a law runs compiled, in batches and, merged, sample by sample.

    u = C x + D (r, y) + o            the demanded command
    x+ = A x + B (r, y) + E (v - o)   knowing the command v that the drive really got

E holds the anti-windup or the observer's knowledge of the drive; o is the constant that starts a loop without a bump.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

Start = Callable[[np.ndarray, float], tuple[np.ndarray, float]]


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

    def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
        x = np.linalg.solve(np.eye(len(a)) - a, b @ signals)
        return x, float(command - c @ x - d @ signals)

    return start


def static(gains: Sequence[float], measures: tuple[str, ...]) -> LinearLaw:
    """u = gains . (r, y) + o: a law without states."""
    a, b, c, d = np.zeros((0, 0)), np.zeros((0, len(gains))), np.zeros(0), np.asarray(gains, float)
    return LinearLaw(a, b, c, d, np.zeros(0), measures, resting(a, b, c, d))


def with_command_filter(
    inner: LinearLaw, matrices: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], inputs: Sequence[str]
) -> LinearLaw:
    """A law with what a stable filter of `inputs` puts out added to its command: w+ = Af w + Bf s, added = Cf w + Df s.

    The inner law learns the command of the drive less what was added.
    """
    names = _merged(inner, inputs)
    own, seen = _pick(("reference", *inner.measures), names), _pick(inputs, names)
    af, bf, cf, df = matrices[0], matrices[1] @ seen, matrices[2].ravel(), (matrices[3] @ seen).ravel()
    n, k = inner.states, len(af)
    a = np.block([[inner.a, -np.outer(inner.e, cf)], [np.zeros((k, n)), af]])
    b = np.vstack((inner.b @ own - np.outer(inner.e, df), bf))
    rest = resting(af, bf, cf, df)

    def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
        w = rest(signals, 0.0)[0]
        x, offset = inner.start(own @ signals, float(command - cf @ w - df @ signals))
        return np.append(x, w), offset

    c, d, e = np.append(inner.c, cf), inner.d @ own + df, np.append(inner.e, np.zeros(k))
    return LinearLaw(a, b, c, d, e, tuple(names[1:]), start)


def with_reference_filter(
    inner: LinearLaw, matrices: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], inputs: Sequence[str]
) -> LinearLaw:
    """A law whose reference is what a stable filter of `inputs` puts out."""
    names = _merged(inner, inputs)
    own, seen = _pick(("reference", *inner.measures), names), _pick(inputs, names)
    own[0] = 0.0  # the filter's output takes this place
    af, bf, cf, df = matrices[0], matrices[1] @ seen, matrices[2].ravel(), (matrices[3] @ seen).ravel()
    n, k = inner.states, len(af)
    a = np.block([[inner.a, np.outer(inner.b[:, 0], cf)], [np.zeros((k, n)), af]])
    b = np.vstack((inner.b @ own + np.outer(inner.b[:, 0], df), bf))
    rest = resting(af, bf, cf, df)

    def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
        w = rest(signals, 0.0)[0]
        inside = own @ signals
        inside[0] = cf @ w + df @ signals
        x, offset = inner.start(inside, command)
        return np.append(x, w), offset

    c, d = np.append(inner.c, inner.d[0] * cf), inner.d @ own + inner.d[0] * df
    return LinearLaw(a, b, c, d, np.append(inner.e, np.zeros(k)), tuple(names[1:]), start)


def on_load_cell(inner: LinearLaw, stiffness: float) -> LinearLaw:
    """A law of position on a load cell: its position is force over stiffness [N/m]."""
    scale = np.ones(len(inner.d))
    scale[1] = 1 / stiffness

    def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
        return inner.start(signals * scale, command)

    return LinearLaw(inner.a, inner.b * scale, inner.c, inner.d * scale, inner.e, ("force", *inner.measures[1:]), start)


def _merged(inner: LinearLaw, inputs: Sequence[str]) -> list[str]:
    own = ["reference", *inner.measures]
    return own + [name for name in inputs if name not in own]


def _pick(wanted: Sequence[str], names: Sequence[str]) -> np.ndarray:
    """The matrix that picks `wanted` signals out of `names`."""
    return np.array([[float(one == other) for other in names] for one in wanted])
