"""TOML files read strictly: every complaint names the file and the line or key, and says what to do."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .errors import InputError, nearest

_PLACE = re.compile(r"\s*\(at (?:line (\d+), column \d+|end of document)\)$")


def read_toml(path: str | Path) -> dict[str, Any]:
    """The tables of a TOML file, UTF-8 with or without a byte-order mark.

    Raises InputError, "file: line N: ...", for a missing file, a folder, a wrong encoding or bad syntax.
    """
    path = Path(path)
    text = _text(path)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        found = _PLACE.search(message)
        line = found.group(1) if found and found.group(1) else str(len(text.splitlines()) or 1)
        raise InputError(f"{path}: line {line}: {_PLACE.sub('', message)}; mend the TOML there") from None


def check_keys(table: Mapping[str, Any], allowed: Iterable[str], where: str) -> None:
    """Refuse a key of `table` that is not `allowed`, naming the nearest known one; `where` opens the message."""
    known = list(allowed)
    for key in table:
        if key not in known:
            raise InputError(f'{where}: unknown key "{key}"; {nearest(key, known)}')


def _text(path: Path) -> str:
    if path.is_dir():
        raise InputError(f"{path}: is a folder, not a TOML file; name the file in it")
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{path}: can not be read ({error.strerror}); check the path and its permissions") from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}: line {line}: not UTF-8 text; save the file as UTF-8") from None
