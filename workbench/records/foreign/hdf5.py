"""HDF5 files, and MATLAB's of version 7.3: groups as structures, tables of named columns, units as attributes."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.errors import InputError, short_path
from .clocks import on_one_clock
from .nested import Leaf, Tree, as_leaf, groups_of
from .source import Source

if TYPE_CHECKING:
    import h5py

_UNITS = ("unit", "units", "Unit", "Units", "einheit")
_NAMES = ("columns", "names", "labels", "channels")
_DEEPEST = 16


def read_hdf5(path: Path) -> Source:
    """Vectors, matrices and tables of a file. Raises InputError for a broken one."""
    notes: list[str] = []
    try:
        tree = hdf5_tree(path, notes)
    except InputError:
        raise
    except Exception as error:  # of the library: OSError, RuntimeError, KeyError, ValueError ...
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{short_path(path)}: broken HDF5 file ({reason}); save it again") from None
    return on_one_clock(groups_of(tree), notes)


def hdf5_tree(path: Path, notes: list[str]) -> Tree:
    """What is in the file; MATLAB's own objects are noted and left out."""
    import h5py

    with h5py.File(path, "r") as file:
        return _tree(file, file, notes, 0)


def _tree(group: "h5py.Group", file: "h5py.File", notes: list[str], depth: int) -> Tree:
    import h5py

    tree: dict[str, Any] = {}
    for name, item in group.items() if depth < _DEEPEST else ():
        if name.startswith("#"):  # what MATLAB's references point at
            continue
        if isinstance(item, h5py.Group):
            tree[name] = _tree(item, file, notes, depth + 1)
        elif "MATLAB_object_decode" in item.attrs:
            notes.append(
                f'"{name}" is an object of MATLAB, which only MATLAB reads; save its time and data as a struct'
            )
        elif (part := _part(item, file, notes, depth)) is not None:
            tree[name] = part
    return tree


def _part(item: Any, file: "h5py.File", notes: list[str], depth: int) -> Tree | Leaf | str | None:
    import h5py

    if item.dtype.names:
        table = np.asarray(item[()])
        leaves = {name: as_leaf(table[name], _text(item.attrs, _UNITS)) for name in item.dtype.names}
        return {name: leaf for name, leaf in leaves.items() if leaf is not None}
    if item.dtype == h5py.ref_dtype:
        parts = [file[reference] for reference in np.ravel(item[()]) if reference]
        trees = {str(i): _tree(part, file, notes, depth + 1) if isinstance(part, h5py.Group)
                 else _part(part, file, notes, depth + 1) for i, part in enumerate(parts, 1)}  # fmt: skip
        return {name: part for name, part in trees.items() if part is not None}
    if item.attrs.get("MATLAB_class") == b"char":
        return "".join(map(chr, np.ravel(item[()]).tolist()))
    if item.shape == () and h5py.check_string_dtype(item.dtype):
        return item.asstr()[()]
    return as_leaf(item[()], _text(item.attrs, _UNITS), _names(item.attrs)) if item.shape else None


def _text(attributes: Mapping[str, Any], names: tuple[str, ...]) -> str | None:
    value = next((attributes[name] for name in names if name in attributes), None)
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    return value if isinstance(value, str) else None


def _names(attributes: Mapping[str, Any]) -> tuple[str, ...]:
    values = next((attributes[name] for name in _NAMES if name in attributes), ())
    return tuple(v.decode(errors="replace") if isinstance(v, bytes) else str(v) for v in np.ravel(values))
