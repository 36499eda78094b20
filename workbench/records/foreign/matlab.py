"""MATLAB files with structures: version 5 by scipy, version 7.3, an HDF5 file, by `hdf5`."""

from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError, short_path
from ..mat import is_hdf5
from .clocks import on_one_clock
from .hdf5 import hdf5_tree
from .nested import Tree, as_leaf, groups_of
from .source import Source

_HINT = "write s = struct('time', ts.Time, 'data', ts.Data) in MATLAB and save that"


def read_mat(path: Path) -> Source:
    """Vectors, structures, structures with time. Raises InputError for a file that is broken or holds none."""
    notes: list[str] = []
    try:
        tree = hdf5_tree(path, notes) if is_hdf5(path) else _version5(path, notes)
    except InputError:
        raise
    except Exception as error:  # of either library: struct.error, zlib.error, OSError, TypeError, ValueError ...
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{short_path(path)}: broken MAT file ({reason}); save it again") from None
    source = on_one_clock(groups_of(tree), notes)
    if not source.headings and notes:
        raise InputError(f"{short_path(path)}: {notes[0]}")
    return source


def _version5(path: Path, notes: list[str]) -> Tree:
    from scipy.io import loadmat

    values = loadmat(path, simplify_cells=True, chars_as_strings=True)
    return _tree({name: value for name, value in values.items() if not name.startswith("__")}, notes)


def _tree(values: dict[str, Any], notes: list[str]) -> Tree:
    tree: dict[str, Any] = {}
    for name, value in values.items():
        if type(value).__name__ in ("MatlabOpaque", "MatlabFunction"):
            notes.append(f'"{name}" is an object of MATLAB, which only MATLAB reads; {_HINT}')
        elif isinstance(value, dict):
            tree[name] = _tree(value, notes)
        elif isinstance(value, str):
            tree[name] = value
        elif isinstance(value, list | np.ndarray) and len(np.shape(value)) == 1 and _are_structures(value):
            tree[name] = {str(i): _tree(part, notes) for i, part in enumerate(value, 1)}
        elif isinstance(value, np.ndarray) and (leaf := as_leaf(value)) is not None:
            tree[name] = leaf
    return tree


def _are_structures(value: Any) -> bool:
    return len(value) > 0 and all(isinstance(part, dict) for part in value)
