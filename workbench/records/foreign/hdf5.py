"""HDF5 files, and MATLAB's of version 7.3: groups as structures, tables of named columns, units as attributes."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.files import MOST_READ, check_numbers
from .clocks import ChannelGroup, on_one_clock
from .labels import Part, cells_part, is_rate, labelled, left_out, with_rates
from .nested import as_leaf, groups_of
from .source import Source

if TYPE_CHECKING:
    import h5py

_UNITS = ("unit", "units", "Unit", "Units", "einheit")
_NAMES = ("columns", "names", "labels", "channels")
_DEEPEST = 16


def read_hdf5(path: Path) -> Source:
    """Vectors, matrices and tables of a file. Raises InputError for more numbers than there is memory for."""
    notes: list[str] = []
    return on_one_clock(groups_in(hdf5_tree(path, notes), notes), notes)


def groups_in(tree: Mapping[str, Part], notes: list[str]) -> list[ChannelGroup]:
    """The groups of a structure as it was read, with what stands beside their numbers; the rest is noted."""
    rates: dict[str, tuple[float, str]] = {}
    left: list[str] = []
    groups = with_rates(groups_of(labelled(tree, rates, left)), rates, left, notes)
    notes += left_out(left)
    return groups


def hdf5_tree(path: Path, notes: list[str]) -> dict[str, Part]:
    """What is in the file; MATLAB's own objects are noted and left out. Raises InputError for too many numbers."""
    import h5py

    with h5py.File(path, "r") as file:
        sizes: list[int] = []
        file.visititems(lambda _, item: sizes.append(item.size or 0) if isinstance(item, h5py.Dataset) else None)
        check_numbers(path, sum(sizes), MOST_READ)
        return _tree(file, file, notes, 0)


def _tree(group: "h5py.Group", file: "h5py.File", notes: list[str], depth: int) -> dict[str, Part]:
    import h5py

    tree: dict[str, Part] = {}
    for name, item in group.items() if depth < _DEEPEST else ():
        if name.startswith("#"):  # what MATLAB's references point at
            continue
        if isinstance(item, h5py.Group):
            tree[name] = _tree(item, file, notes, depth + 1)
        elif "MATLAB_object_decode" in item.attrs:
            notes.append(
                f'"{name}" is an object of MATLAB, which only MATLAB reads; save its time and data as a struct'
            )
        else:
            tree[name] = _part(item, file, notes, depth)
            tree = _rates(item) | tree
    return _rates(group) | tree


def _rates(item: Any) -> dict[str, Part]:
    """Attributes that tell a sample rate."""
    told = {name: value for name, value in item.attrs.items() if is_rate(name) and _is_number(value)}
    return {name: float(np.ravel(value)[0]) for name, value in told.items()}


def _part(item: Any, file: "h5py.File", notes: list[str], depth: int) -> Part:
    import h5py

    if isinstance(item, h5py.Group):
        return _tree(item, file, notes, depth + 1)
    if item.dtype.names:
        table = np.asarray(item[()])
        return {name: _column(table[name], _text(item.attrs, _UNITS)) for name in item.dtype.names}
    if item.shape is None or "MATLAB_empty" in item.attrs:
        return None
    if h5py.check_ref_dtype(item.dtype):
        cells = np.transpose(item[()]) if depth < _DEEPEST else np.zeros(0)
        parts = [_part(file[cell], file, notes, depth + 1) if cell else None for cell in np.ravel(cells)]
        return cells_part(parts, cells.shape)
    if item.attrs.get("MATLAB_class") == b"char":
        lines = ["".join(map(chr, line)) for line in np.atleast_2d(np.transpose(item[()])).tolist()]
        return lines[0] if len(lines) == 1 else cells_part(lines, [len(lines)])
    if h5py.check_string_dtype(item.dtype):
        texts = np.asarray(item.asstr()[()], dtype=object).ravel().tolist()
        return cells_part(texts, [len(texts)]) if item.shape else texts[0]
    values = np.asarray(item[()])
    if _is_number(values):
        return float(values.item())
    return as_leaf(values, _text(item.attrs, _UNITS), _names(item.attrs))


def _column(values: np.ndarray, unit: str | None) -> Part:
    if values.dtype.kind not in "SO":
        return as_leaf(values, unit)
    texts = [cell.decode(errors="replace") if isinstance(cell, bytes) else cell for cell in values.ravel()]
    return cells_part(texts, [len(texts)]) if all(isinstance(text, str) for text in texts) else None


def _is_number(value: Any) -> bool:
    return np.size(value) == 1 and np.asarray(value).dtype.kind in "iufb"


def _text(attributes: Mapping[str, Any], names: tuple[str, ...]) -> str | None:
    value = next((attributes[name] for name in names if name in attributes), None)
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    return value if isinstance(value, str) else None


def _names(attributes: Mapping[str, Any]) -> tuple[str, ...]:
    values = next((attributes[name] for name in _NAMES if name in attributes), ())
    return tuple(v.decode(errors="replace") if isinstance(v, bytes) else str(v) for v in np.ravel(values))
