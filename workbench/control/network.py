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

The command is `limit` a, or that added to another law's, held until the next decision. Networks are read from .npz
files that somebody wrote: numbers and names, every shape checked.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any, cast
from zipfile import ZipFile

import numpy as np

from ..base.errors import InputError, echo, short_path
from ..base.files import MEBIBYTE, read_bytes

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
_TEXT, _SQUASHES = ("signals", "squash"), ("tanh", "clip")
_LARGEST = 16 * MEBIBYTE  # of a file, unpacked too


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
        """This network with other weights and biases [j]."""
        numbers = np.asarray(numbers, float)
        memory = self.memory and replace(self.memory, V=self.gates(numbers, np.reshape))
        return replace(self, layers=tuple(self.layered(numbers, np.reshape)), memory=memory)

    def with_number(self, place: int, value: float) -> "Network":
        """This network with another one of its `numbers`."""
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


def read_network(path: Path) -> Network:
    """A network from an .npz file: the arrays of SHAPES, and W1, b1, W2, b2, ... Objects are not unpacked.

    Raises InputError with file and array for what is missing, of another shape, or not finite.
    """
    shown, arrays = short_path(path), _arrays(path)
    for key in (*SHAPES, "W1", "b1"):
        if key not in arrays:
            raise InputError(f"{shown}: has no array {key}; write it as workbench.control.network says")
    _check_kinds(arrays, shown)
    _check_shapes(arrays, shown)
    single: dict[str, Any] = {key: arrays[key].item() for key, shape in SHAPES.items() if not shape}
    _check_numbers(arrays, single, shown)
    many = {key: np.asarray(arrays[key], float) for key in ("A", "B", "C", "D", "shift")}
    layers, signals = _layers(arrays, shown), tuple(arrays["signals"].tolist())
    return Network(signals=signals, layers=layers, memory=_memory(arrays, layers, shown), **many, **single)


def _arrays(path: Path) -> Mapping[str, np.ndarray]:
    content = read_bytes(path, kind="network", most=_LARGEST)
    try:
        with ZipFile(BytesIO(content)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _LARGEST:
                raise ValueError(f"more than {_LARGEST // MEBIBYTE} MiB unpacked")
        with np.load(BytesIO(content), allow_pickle=False) as file:
            return {key: file[key] for key in cast(Any, file).files}
    except Exception as error:  # whatever a damaged archive makes numpy and zipfile raise
        what = f"is no .npz file of numbers ({echo(str(error))})"
        raise InputError(f"{short_path(path)}: {what}; save one with numpy.savez, without objects") from None


def _check_kinds(arrays: Mapping[str, np.ndarray], shown: str) -> None:
    for key, values in arrays.items():
        if values.dtype.kind not in ("U" if key in _TEXT else "fiu"):
            what = "text" if key in _TEXT else "numbers"
            raise InputError(f"{shown}: {echo(key)} holds {values.dtype}; give {what}")


def _check_shapes(arrays: Mapping[str, np.ndarray], shown: str) -> None:
    n, m, k = (arrays[key].shape[0] if arrays[key].ndim else 0 for key in ("A", "signals", "shift"))
    sizes = {"n": n, "m": m, "k": k, "1 + m": 1 + m, "2 + m": 2 + m}
    for key, names in SHAPES.items():
        shape = tuple(sizes[name] for name in names)
        if arrays[key].shape != shape:
            text = f"{m} signals, a past of {n} and {k} inputs"
            raise InputError(f"{shown}: {key} has the shape {arrays[key].shape}; {text} need {shape}")


def _check_numbers(arrays: Mapping[str, np.ndarray], single: Mapping[str, Any], shown: str) -> None:
    for key, values in arrays.items():
        if key not in (*_TEXT, "bound") and not np.isfinite(values).all():
            raise InputError(f"{shown}: {key} has numbers that are not finite; train it anew")
    if single["squash"] not in _SQUASHES:
        raise InputError(f"{shown}: squash is {echo(single['squash'])}; give {' or '.join(_SQUASHES)}")
    for key, most in (("bound", np.inf), ("limit", 1.0), ("decision", 1.0)):
        if not 0 < single[key] <= most:
            raise InputError(f"{shown}: {key} is {single[key]:g}; it must be above 0, and {most:g} at most")
    if not arrays["signals"].size or len(set(arrays["signals"].tolist())) < arrays["signals"].size:
        raise InputError(f"{shown}: signals must be different names, the controlled one first")
    if len(arrays["A"]) and np.abs(np.linalg.eigvals(arrays["A"])).max() >= 1:
        raise InputError(f"{shown}: A does not forget, as an eigenvalue is not inside the unit circle")


def _layers(arrays: Mapping[str, np.ndarray], shown: str) -> tuple[Layer, ...]:
    """Raises InputError where one does not fit the one before."""
    layers: list[Layer] = []
    width = len(arrays["shift"])
    while f"W{(i := len(layers) + 1)}" in arrays:
        weights, biases = (np.asarray(arrays.get(f"{letter}{i}", 0.0), float) for letter in "Wb")
        if weights.ndim != 2 or weights.shape[1] != width or biases.shape != weights.shape[:1]:
            shapes = f"W{i} and b{i} have the shapes {weights.shape} and {biases.shape}"
            raise InputError(f"{shown}: {shapes}; they need {width} columns, and an entry for each row")
        layers.append((weights, biases))
        width = len(biases)
    if width != 1:
        raise InputError(f"{shown}: the last layer has {width} rows; a command needs 1")
    return tuple(layers)


def _memory(arrays: Mapping[str, np.ndarray], layers: tuple[Layer, ...], shown: str) -> Memory | None:
    """What it remembers; None where the file has none of its arrays. Raises InputError."""
    if not any(key in arrays for key in MEMORY):
        return None
    if missing := [key for key in MEMORY if key not in arrays]:
        raise InputError(f"{shown}: has no array {missing[0]}; a network that remembers has {', '.join(MEMORY)}")
    if len(layers) < 2 or arrays["V"].shape != layers[0][0].shape:
        raise InputError(f"{shown}: V has the shape {arrays['V'].shape}; it needs that of W1, of a hidden layer")
    single = {}
    for key in ("forgets", "floor"):
        if arrays[key].ndim or not 0 < arrays[key] <= 1:
            raise InputError(f"{shown}: {key} must be one number above 0, and 1 at most")
        single[key] = float(arrays[key])
    return Memory(np.asarray(arrays["V"], float), **single)
