"""Columns of numbers that come block by block and are read one by one: on disk, so that memory stays free of them."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from weakref import finalize

import numpy as np


class KeptColumns(Mapping[str, np.ndarray]):
    """Columns [n] by name, each in a file that goes with them; one is read whenever it is asked for."""

    def __init__(self) -> None:
        folder = TemporaryDirectory()
        finalize(self, folder.cleanup)
        self._folder = Path(folder.name)
        self._types: dict[str, np.dtype] = {}

    def append(self, columns: Mapping[str, np.ndarray]) -> None:
        """Put a block behind what there is of each column; the first one sets its type."""
        for name, values in columns.items():
            kind = self._types.setdefault(name, values.dtype)
            with self._file(name).open("ab") as file:
                file.write(values.astype(kind).tobytes())

    def __getitem__(self, name: str) -> np.ndarray:
        kind = self._types[name]
        return np.fromfile(self._file(name), kind)

    def parts(self, rows: int) -> Iterator[dict[str, np.ndarray]]:
        """All columns, so many rows at a time, of columns of one length."""
        name = next(iter(self._types))
        for first in range(0, self._file(name).stat().st_size // self._types[name].itemsize, rows):
            yield {
                name: np.fromfile(self._file(name), kind, rows, offset=first * kind.itemsize)
                for name, kind in self._types.items()
            }

    def __iter__(self) -> Iterator[str]:
        return iter(self._types)

    def __len__(self) -> int:
        return len(self._types)

    def _file(self, name: str) -> Path:
        return self._folder / str(list(self._types).index(name))
