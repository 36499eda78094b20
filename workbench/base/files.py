"""Files that somebody else made: only regular ones are read, and no more of them than there is room for."""

import gzip
import json
import os
import stat
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from .errors import InputError, echo, short_path

WINDOWS = sys.platform == "win32"  # it syncs no folder and no file that is open for reading, renames none in use
MEBIBYTE = 2**20
MOST_BYTES = 256 * MEBIBYTE  # of a record, unpacked; it takes several times as much to read it
MOST_READ = 2 * MOST_BYTES  # of a foreign file that is in memory whole, as doubles
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)  # a pipe would wait for its writer
_LONGEST_NAME = 100  # bytes; a file's name has two of them, and 255 bytes at most
_NOT_IN_NAMES = set("/\\") | (set('<>:"|?*') if WINDOWS else set())


@contextmanager
def open_file(path: Path, shown: str | None = None, kind: str = "file") -> Iterator[BinaryIO]:
    """A regular file, open for reading. `kind` says what it should be, `shown` how messages name it.

    Raises InputError for a missing file, a folder, a pipe or a device, and for one that cannot be read.
    """
    shown = short_path(path if shown is None else shown)
    try:
        descriptor = os.open(path, _FLAGS)
    except FileNotFoundError:
        raise InputError(f"{shown}: no such file; check the path") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{shown}: cannot be read ({_reason(error)}); check the path and its permissions") from None
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        if stat.S_ISDIR(mode):
            raise InputError(f"{shown}: is a folder, not a {kind}; name the file in it")
        raise InputError(f"{shown}: is a pipe or a device, not a {kind}; save what it gives to a file")
    with open(descriptor, "rb") as file:
        yield file


def read_bytes(path: Path, shown: str | None = None, kind: str = "file", most: int = MOST_BYTES) -> bytes:
    """All of a regular file, unpacked where its name ends in .gz.

    Raises InputError as `open_file` does, for a broken .gz, and for more than `most` bytes.
    """
    named = short_path(path if shown is None else shown)
    with open_file(path, shown, kind) as file:
        try:
            source = gzip.GzipFile(fileobj=file) if path.suffix.lower() == ".gz" else file
            content = source.read(most + 1)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise InputError(f"{named}: broken or truncated gzip file ({error}); copy or record it again") from None
        except OSError as error:
            raise InputError(f"{named}: cannot be read ({_reason(error)}); copy it to this disk") from None
    if len(content) > most:
        raise InputError(f"{named}: more than {most // MEBIBYTE} MiB, too large for a {kind}; split it")
    return content


def check_numbers(path: Path, numbers: int, most: int = MOST_BYTES) -> None:
    """Raises InputError for more numbers than `most` bytes hold as doubles, before they are read."""
    if 8 * numbers > most:
        raise InputError(f"{short_path(path)}: {numbers} numbers are more than {most // MEBIBYTE} MiB; split it")


def read_json(path: Path) -> Any:
    """The value of a JSON file. Raises InputError as `read_bytes` does, and for what is no JSON."""
    content = read_bytes(path, kind="JSON file")
    try:
        return json.loads(content)
    except RecursionError:
        raise InputError(f"{short_path(path)}: nested too deeply; write it again") from None
    except ValueError as error:
        raise InputError(f"{short_path(path)}: cannot be read as JSON ({error}); write it again") from None


def check_place(path: Path, option: str = "") -> None:
    """Raises InputError, that names the `option` it is of, where no file can be written at this path."""
    shown = f"{option} {short_path(path)}".strip()
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        if not path.parent.is_dir():
            raise InputError(f"{shown}: no folder {short_path(path.parent)}; make it first") from None
        if not os.access(path.parent, os.W_OK):
            raise InputError(f"{shown}: {short_path(path.parent)} cannot be written; choose another folder") from None
        return
    except (OSError, ValueError) as error:
        raise InputError(f"{shown}: {_reason(error)}; choose another") from None
    if not stat.S_ISREG(mode):
        raise InputError(f"{shown}: is no file; choose another")


def name_problem(name: str) -> str:
    """Why a name cannot be part of the names of files that results are stored in; nothing where it can."""
    if not name.strip() or not name.isprintable() or name.startswith(".") or _NOT_IN_NAMES & set(name):
        return f'{echo(name)} is no name to store results by; write letters, digits, "-" and "_"'
    if len(name.encode()) > _LONGEST_NAME:
        return f"a name of {len(name)} characters; write {_LONGEST_NAME} at most"
    return ""


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)


def write_whole(path: Path, text: str) -> None:
    """Write a whole file or none, to the disk."""
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        sync(part)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    if WINDOWS and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDWR if WINDOWS else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
