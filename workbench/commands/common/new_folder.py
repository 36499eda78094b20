"""A folder of files that a command makes at once."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from ...base.errors import InputError


def check_new(folder: Path) -> None:
    """Raises InputError where no such folder can be made, or where there is something already."""
    if folder.exists():
        raise InputError(f"{folder}: exists already; choose another folder")
    if not folder.absolute().parent.is_dir():
        raise InputError(f"{folder}: no folder {folder.absolute().parent}; make it first")


def write_folder(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """All files, by their path in the folder, or none. Raises InputError where the folder cannot be made."""
    try:
        with TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.absolute().parent) as place:
            unfinished = Path(place) / "files"
            for name, content in files.items():
                path = unfinished / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content.encode() if isinstance(content, str) else content)
            unfinished.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: {error.strerror}; choose another folder") from None
