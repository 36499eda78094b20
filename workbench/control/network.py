"""Small networks of measured signals and their past, as arrays.

At each decision, s = (r, y) the reference and the measured signals, v the command that the drive really got last:

    z = clip(C x + D s + shift, -bound, bound)       what the network is shown; x the past
    h = tanh(W1 z + b1), tanh(W2 h + b2), ...        hidden layers, as many as there are but for the last
    a = squash(Wn h + bn)                            -1..1, by "tanh" or "clip"
    x+ = A x + B (s, v)                              at the end of the decision

A network that remembers has in the place of its first hidden layer

    h = tanh((W1 z + b1) exp(V m / (sum m + floor)))    element by element
    m+ = m + forgets (z^2 - m)                       from 0 at a start

so that the energies of its inputs over its last motions, one over all, decide how steep its units are: the same for a
motion to either side, and for one of twice the size.

The command is `limit` a, or that added to another law's, held until the next decision.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from typing import Any

import numpy as np

Layer = tuple[np.ndarray, np.ndarray]


# the arrays of a file by their name, besides W1, b1, W2, b2, ...: shapes in n, m and k, () a single entry
SHAPES: dict[str, tuple[str, ...]] = {
    "signals": ("m",),
    "A": ("n", "n"),
    "B": ("n", "2 + m"),
    "C": ("k", "n"),
    "D": ("k", "1 + m"),
    "shift": ("k",),
    "bound": (),
    "squash": (),
    "limit": (),
    "decision": (),
}
MEMORY = "V", "forgets", "floor"  # further ones, of a network that remembers


@dataclass(frozen=True, eq=False)
class Memory:
    """What a network keeps of its inputs z [k]: energies, `forgets` of which a decision forgets; `floor` is added to
    their sum. V [units of the first hidden layer, k]."""

    V: np.ndarray
    forgets: float
    floor: float


@dataclass(frozen=True, eq=False, repr=False)
class Network:
    """A network, its past and its scales; networks of the same numbers are equal.

    signals: m measured ones by name, the controlled one first, SI. A [n, n], B [n, 2 + m], C [k, n], D [k, 1 + m],
    shift [k], bound: of the inputs z [k]. layers: (W [out, in], b [out]) from the first, W1 with k columns, to the last
    with one row. decision: time between decisions [s], a multiple of the control period.
    """

    signals: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    shift: np.ndarray
    bound: float
    layers: tuple[Layer, ...]
    squash: str
    limit: float
    decision: float
    memory: Memory | None = None

    @property
    def numbers(self) -> np.ndarray:
        """Weights and biases of all layers [j]: W row by row, then b, from the first layer to the last; then V."""
        return np.concatenate([part.ravel() for part in self._parts])

    @property
    def are_biases(self) -> np.ndarray:
        """Which of the `numbers` are biases: bool [j]."""
        return np.concatenate([np.full(part.size, part.ndim == 1) for part in self._parts])

    @property
    def remembers(self) -> int:
        """How many energies it keeps."""
        return 0 if self.memory is None else self.memory.V.shape[1]

    @property
    def _parts(self) -> list[np.ndarray]:
        return [*(part for layer in self.layers for part in layer), *([] if self.memory is None else [self.memory.V])]

    def with_numbers(self, numbers: np.ndarray) -> "Network":
        """The same with other weights and biases [j]."""
        numbers = np.asarray(numbers, float)
        memory = self.memory and replace(self.memory, V=self.gates(numbers, np.reshape))
        return replace(self, layers=tuple(self.layered(numbers, np.reshape)), memory=memory)

    def with_number(self, place: int, value: float) -> "Network":
        """The same with another one of its `numbers`."""
        numbers = self.numbers
        numbers[place] = value
        return self.with_numbers(numbers)

    def layered(self, numbers: Any, shaped: Callable[[Any, tuple[int, ...]], Any]) -> list[Any]:
        """Layers (W, b) of `numbers` [j], each part cut out and `shaped`: of arrays, or of symbols."""
        layers, first = [], 0
        for weights, biases in self.layers:
            last = first + weights.size
            own = shaped(numbers[first:last], weights.shape), shaped(numbers[last : last + biases.size], biases.shape)
            layers.append(own)
            first = last + biases.size
        return layers

    def gates(self, numbers: Any, shaped: Callable[[Any, tuple[int, ...]], Any]) -> Any:
        """V of `numbers` [j], of a network that remembers."""
        assert self.memory is not None
        shape = self.memory.V.shape
        return shaped(numbers[sum(part.size for layer in self.layers for part in layer) :], shape)

    def rest(self, signals: np.ndarray, commands: np.ndarray) -> np.ndarray:
        """The past x [lanes, n] after a long time at s = (r, y) [lanes, 1 + m] and commands [lanes]."""
        entering = np.column_stack((signals, commands)) @ self.B.T
        return np.linalg.solve(np.eye(len(self.A)) - self.A, entering.T).T

    def commands(self, x: np.ndarray, signals: np.ndarray) -> np.ndarray:
        """`limit` a [lanes] of pasts [lanes, n] and s = (r, y) [lanes, 1 + m], where nothing is remembered."""
        h = np.clip(x @ self.C.T + signals @ self.D.T + self.shift, -self.bound, self.bound)
        for weights, biases in self.layers[:-1]:
            h = np.tanh(h @ weights.T + biases)
        weights, biases = self.layers[-1]
        a = (h @ weights.T + biases)[:, 0]
        return self.limit * (np.tanh(a) if self.squash == "tanh" else np.clip(a, -1, 1))

    def packed(self) -> bytes:
        """An .npz file of it."""
        file, layers = BytesIO(), enumerate(self.layers, 1)
        weights = {f"{letter}{i}": part for i, layer in layers for letter, part in zip("Wb", layer, strict=True)}
        arrays: dict[str, Any] = {key: np.asarray(getattr(self, key)) for key in SHAPES} | weights
        if self.memory is not None:
            arrays |= {key: np.asarray(getattr(self.memory, key)) for key in MEMORY}
        np.savez(file, **arrays)
        return file.getvalue()

    @cached_property
    def structure(self) -> tuple[Any, ...]:
        """All but the `numbers`: networks of one structure share their graphs."""
        past = (part.tobytes() for part in (self.A, self.B, self.C, self.D, self.shift))
        sizes = tuple(weights.shape for weights, _ in self.layers)
        keeps = None if self.memory is None else (self.memory.forgets, self.memory.floor)
        return (self.signals, self.bound, self.squash, self.limit, self.decision, sizes, keeps, *past)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Network):
            return NotImplemented
        return self.structure == other.structure and self.numbers.tobytes() == other.numbers.tobytes()

    def __hash__(self) -> int:
        return hash((self.structure, self.numbers.tobytes()))

    def __repr__(self) -> str:
        sizes = [len(self.shift), *(len(biases) for _, biases in self.layers)]
        return f"network {'-'.join(map(str, sizes))} of {', '.join(self.signals)}"
