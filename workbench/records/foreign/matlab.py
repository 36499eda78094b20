"""MATLAB files with structures and cells: versions 4 and 5 by scipy, version 7.3, an HDF5 file, by `hdf5`."""

from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError, short_path
from ..mat import is_hdf5, mat_variables
from .clocks import on_one_clock
from .hdf5 import groups_in, hdf5_tree
from .labels import Part, cells_part
from .nested import as_leaf
from .source import Source

_HINT = "write s = struct('time', ts.Time, 'data', ts.Data) in MATLAB and save that"


def read_mat(path: Path) -> Source:
    """Vectors, structures, cells, structures with time. Raises InputError for a file that holds none."""
    notes: list[str] = []
    if is_hdf5(path):
        tree = hdf5_tree(path, notes)
    else:
        tree = _tree(mat_variables(path, simplify_cells=True, chars_as_strings=True), notes)
    source = on_one_clock(groups_in(tree, notes), notes)
    if not source.headings and notes:
        raise InputError(f"{short_path(path)}: {notes[0]}")
    return source


def _tree(values: dict[str, Any], notes: list[str]) -> dict[str, Part]:
    return {name: _part(name, value, notes) for name, value in values.items()}


def _part(name: str, value: Any, notes: list[str]) -> Part:
    if type(value).__name__ in ("MatlabOpaque", "MatlabFunction"):
        notes.append(f'"{name}" is an object of MATLAB, which only MATLAB reads; {_HINT}')
        return {}
    if isinstance(value, dict):
        return _tree(value, notes)
    if isinstance(value, str):
        return value
    if isinstance(value, bool | int | float):
        return float(value)
    if isinstance(value, list):
        value = np.asarray(value, dtype=object)
    if not isinstance(value, np.ndarray):
        return None
    if value.dtype.kind == "U":
        return cells_part(value.ravel().tolist(), [value.size])
    if value.dtype.kind == "O":
        return cells_part([_part(name, cell, notes) for cell in value.ravel()], value.shape)
    return as_leaf(value)
