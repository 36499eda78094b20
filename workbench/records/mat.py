"""MATLAB files: of versions 4 and 5 by scipy, of version 7.3, HDF5 files, by h5py.

scipy's reader, written in C, ends the process at a type that does not exist, as one damaged byte can make it: call
what reads a file through `contained`.
"""

from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ..base.files import MOST_READ, check_numbers, open_file


def vectors(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Name and numbers [n] of every real vector in a .mat file; scalars, matrices, text and structures are left out.

    Raises InputError for more than a record may have, and what its libraries raise for a broken file.
    """
    arrays = _hdf5(path) if is_hdf5(path) else mat_variables(path)
    for name, values in arrays.items():
        if isinstance(values, np.ndarray) and values.dtype.kind in "iuf" and 1 < values.size == max(values.shape):
            yield name, values.ravel()


def is_hdf5(path: Path) -> bool:
    """Whether a file is HDF5, as MATLAB's are since version 7.3."""
    with open_file(path, kind="record") as file:
        head = file.read(520)
    return b"\x89HDF" in (head[:4], head[512:516])  # MATLAB puts its own 512 bytes before


def mat_variables(path: Path, **how: bool) -> dict[str, Any]:
    """The variables of a file of version 4 or 5 by name, with scipy's options. Raises what scipy does."""
    from scipy.io import loadmat, whosmat

    check_numbers(path, sum(prod(shape) for _, shape, _ in whosmat(path, appendmat=False)), MOST_READ)
    variables = loadmat(path, appendmat=False, **how)
    return {name: value for name, value in variables.items() if not name.startswith("__")}


def _hdf5(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        items = {
            name: item
            for name, item in file.items()
            if isinstance(item, h5py.Dataset) and item.shape and 1 < prod(item.shape) == max(item.shape)
        }
        check_numbers(path, sum(prod(item.shape) for item in items.values()))
        return {name: np.asarray(item[()]) for name, item in items.items()}
