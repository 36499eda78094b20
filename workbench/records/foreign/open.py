"""A foreign file by its suffix."""

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path

from ...base.errors import InputError, short_path
from ...base.files import open_file
from .epochs import since_first_row
from .source import Source

READERS: Mapping[str, str] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm", ".csv.gz", ".txt.gz"), "csv_text:read_csv"),
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
    """Open a recording of any known kind. Raises InputError for one that is missing, empty, broken or unknown."""
    check_foreign(path)
    module, name = READERS[suffix_of(path)].split(":")
    reader: Callable[[Path], Source] = getattr(import_module(f".{module}", __package__), name)
    return since_first_row(reader(path))
