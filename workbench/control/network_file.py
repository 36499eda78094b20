"""Networks read from .npz files that somebody wrote: numbers and names, every shape checked."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, cast
from zipfile import ZipFile

import numpy as np

from ..base.errors import InputError, echo, short_path
from ..base.files import MEBIBYTE, read_bytes
from .network import MEMORY, SHAPES, Layer, Memory, Network

_TEXT, _SQUASHES = ("signals", "squash"), ("tanh", "clip")
_LARGEST = 16 * MEBIBYTE  # of a file, unpacked too


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
