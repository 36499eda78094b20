"""TOML files read strictly: every complaint names the file and the line, and says what to do."""

import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from .errors import InputError
from .key_lines import key_lines
from .table import Place, Table

_PLACE = re.compile(r"\s*\(at (?:line (\d+), column \d+|end of document)\)$")
_LONG_NUMBER = re.compile(r"[0-9_]{1000,}")


def read_toml(path: str | Path, shown: str | None = None) -> Table:
    """The document of a TOML file, UTF-8 with or without a byte-order mark; messages name it `shown`.

    Raises InputError, "file: line N: ...", for a missing file, a folder, a wrong encoding or bad syntax.
    """
    path = Path(path)
    shown = str(path) if shown is None else shown
    text = _text(path, shown)
    return Table(_parsed(text, shown), Place(shown, (), cache(lambda: key_lines(text))))


def _parsed(text: str, shown: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        place = _PLACE.search(message)
        line = place.group(1) if place and place.group(1) else str(len(text.splitlines()) or 1)
        raise InputError(f"{shown}: line {line}: {_PLACE.sub('', message)[:200]}; mend the TOML there") from None
    except RecursionError:
        raise InputError(f"{shown}: nested too deeply; write fewer tables inside tables") from None
    except ValueError:  # Python reads no whole number of more than 4300 digits
        number = _LONG_NUMBER.search(text)
        line = f"line {text.count(chr(10), 0, number.start()) + 1}: " if number else ""
        raise InputError(f"{shown}: {line}a number of too many digits; write it like 1.0e9") from None


def _text(path: Path, shown: str) -> str:
    if path.is_dir():
        raise InputError(f"{shown}: is a folder, not a TOML file; name the file in it")
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{shown}: no such file; check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{shown}: cannot be read ({reason}); check the path and its permissions") from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(f"{shown}: line {line}: not UTF-8 text; save the file as UTF-8") from None
