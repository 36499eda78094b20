"""A foreign file by its suffix."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ...base.contained import contained
from ...base.errors import InputError, short_path
from ...base.files import open_file
from .origin import since_first_row
from .source import Heading, Source

_PIECE = 2**22  # numbers that come from the other process at once
_TEXT = "csv_text:read_csv"
READERS: Mapping[str, str] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm", ".csv.gz", ".txt.gz"), _TEXT),
    ".mat": "matlab:read_mat",
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), "hdf5:read_hdf5"),
    ".parquet": "parquet:read_parquet",
    ".tdms": "tdms:read_tdms",
    **dict.fromkeys((".mf4", ".mdf"), "mdf:read_mdf"),
    **dict.fromkeys((".xlsx", ".xlsm"), "xlsx:read_xlsx"),
    **dict.fromkeys((".rpc", ".rpc3", ".rsp", ".drv", ".tim"), "rpc:read_rpc"),
    **dict.fromkeys((".uff", ".unv", ".uf"), "uff:read_uff"),
}
"""Module and function by suffix; only the one that is needed is imported."""


def suffix_of(path: Path) -> str:
    """The suffix that says how a file is read. Raises InputError for one that nothing reads."""
    name = path.name.lower()
    matching = [suffix for suffix in READERS if name.endswith(suffix)]
    if not matching:
        kinds = ", ".join(READERS)
        raise InputError(f"{short_path(path)}: not a known kind of recording; export it as one of {kinds}")
    return max(matching, key=len)


def check_foreign(path: Path) -> None:
    """Raises InputError for a recording that is missing, empty or of an unknown kind."""
    suffix_of(path)
    with open_file(path, kind="recording") as file:
        if not file.read(1):
            raise InputError(f"{short_path(path)}: the file is empty; record or export it again")


def open_foreign(path: Path) -> Source:
    """Open a recording of any known kind. Raises InputError for one that is missing, empty, broken or unknown.

    Text is read here, all else in a process of its own.
    """
    check_foreign(path)
    if READERS[suffix_of(path)] == _TEXT:
        return _read(path)
    pieces = contained(_pieces, path)
    headings, period, notes = next(pieces)

    def blocks() -> Iterator[Sequence[np.ndarray]]:
        for block, said in pieces:
            notes[:] = said
            if block:
                yield block

    return Source(tuple(Heading(*each) for each in headings), blocks(), period, notes)


def _read(path: Path) -> Source:
    module, name = READERS[suffix_of(path)].split(":")
    reader: Callable[[Path], Source] = getattr(import_module(f".{module}", __package__), name)
    return since_first_row(reader(path))


def _pieces(path: Path) -> Iterator[Sequence[Any]]:
    """What is known of a recording, then its blocks, each with what is said of it by then."""
    source = _read(path)
    yield [astuple(heading) for heading in source.headings], source.period, source.notes
    rows = max(1, _PIECE // max(1, len(source.headings)))
    for block in source.blocks:
        for first in range(0, len(block[0]) if block else 0, rows):
            yield [values[first : first + rows] for values in block], source.notes
    yield [], source.notes
