"""MATLAB files: version 5 by scipy, version 7.3 (an HDF5 file) by h5py."""

from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError


def vectors(path: Path) -> dict[str, np.ndarray]:
    """Every real numeric vector in a .mat file, name -> [n]; scalars, matrices, text and structures are left out.

    Raises InputError for a file that is broken or not MATLAB's.
    """
    try:
        arrays = _hdf5(path) if _is_hdf5(path) else _version5(path)
    except Exception as error:  # of either library: struct.error, zlib.error, OSError, TypeError, ValueError ...
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{path}: broken MAT file ({reason}); save it again") from None
    return {name: values.ravel() for name, values in arrays.items() if _is_vector(values)}


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(520)
    return b"\x89HDF" in (head[:4], head[512:516])  # MATLAB puts its own 512 bytes before


def _version5(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    return loadmat(path)


def _hdf5(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        return {name: np.asarray(item[()]) for name, item in file.items() if isinstance(item, h5py.Dataset)}


def _is_vector(values: Any) -> bool:
    return isinstance(values, np.ndarray) and values.dtype.kind in "iuf" and 1 < values.size == max(values.shape)
