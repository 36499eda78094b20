"""MATLAB files: version 4 by scipy, version 5 by `mat5`, version 7.3 (an HDF5 file) by h5py."""

from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.files import MEBIBYTE, MOST_BYTES, open_file
from .mat5 import is_version5, numeric_arrays


def vectors(path: Path) -> dict[str, np.ndarray]:
    """Every real numeric vector in a .mat file, name -> [n]; scalars, matrices, text and structures are left out.

    Raises InputError for a file that is broken or not MATLAB's, and for vectors of more than MOST_BYTES in all.
    """
    hdf5 = is_hdf5(path)
    try:
        arrays = _hdf5(path) if hdf5 else numeric_arrays(path) if is_version5(path) else _version4(path)
    except InputError:
        raise
    except Exception as error:  # of either library: struct.error, zlib.error, OSError, TypeError, ValueError ...
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{path}: broken MAT file ({reason}); save it again") from None
    return {name: values.ravel() for name, values in arrays.items() if _is_vector(values)}


def is_hdf5(path: Path) -> bool:
    """Whether a file is HDF5, as MATLAB's are since version 7.3."""
    with open_file(path, kind="record") as file:
        head = file.read(520)
    return b"\x89HDF" in (head[:4], head[512:516])  # MATLAB puts its own 512 bytes before


def _version4(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    return loadmat(path, appendmat=False)


def _hdf5(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        items = {
            name: item
            for name, item in file.items()
            if isinstance(item, h5py.Dataset) and item.shape and 1 < prod(item.shape) == max(item.shape)
        }
        _check_size(path, sum(prod(item.shape) for item in items.values()))
        return {name: np.asarray(item[()]) for name, item in items.items()}


def _check_size(path: Path, numbers: int) -> None:
    if 8 * numbers > MOST_BYTES:
        limit = f"more than {MOST_BYTES // MEBIBYTE} MiB, too large for a record"
        raise InputError(f"{path}: {numbers} numbers are {limit}; split it")


def _is_vector(values: Any) -> bool:
    return isinstance(values, np.ndarray) and values.dtype.kind in "iuf" and 1 < values.size == max(values.shape)
