"""TOML files read strictly: every complaint names the file and the line, and says what to do."""

import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from .errors import InputError, short_path
from .files import MEBIBYTE, read_bytes
from .key_lines import key_lines
from .table import ConfigTable, TableLocation

_PLACE = re.compile(r"\s*\(at (?:line (\d+), column \d+|end of document)\)$")
_LONG_NUMBER = re.compile(r"[0-9_]{1000,}")
_MOST_BYTES = 4 * MEBIBYTE
_DEEPEST = 50  # tables and lists in each other
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![A-Za-z0-9_\"'-]){_PART}(?:\.[ \t]*+{_PART}){{{_DEEPEST}}}")


def read_toml(path: str | Path, shown: str | None = None) -> ConfigTable:
    """The document of a TOML file, UTF-8 with or without a byte-order mark; messages name it `shown`.

    Raises InputError, "file: line N: ...", for a missing file, a folder, a wrong encoding, bad syntax, what is nested
    too deeply, and text with a NUL character, which no path and no name can have.
    """
    path = Path(path)
    shown = short_path(path) if shown is None else shown
    text = _text(path, shown)
    place = TableLocation(shown, (), cache(lambda: key_lines(text)))
    return ConfigTable(_checked(_parsed(text, shown), place), place)


def _checked(values: dict[str, Any], place: TableLocation) -> dict[str, Any]:
    """The document as it is. Raises InputError for what is nested too deeply, and for a NUL in a text or a key."""
    level: list[tuple[Any, TableLocation]] = [(values, place)]
    for _ in range(_DEEPEST):
        inside: list[tuple[Any, TableLocation]] = []
        for value, at in level:
            if isinstance(value, str) and "\0" in value:
                raise InputError(f"{at}: holds a NUL character; remove it")
            items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
            inside += [(item, at.inside(key)) for key, item in items if isinstance(item, dict | list | str)]
            if isinstance(value, dict) and any("\0" in key for key in value):
                raise InputError(f"{at}: a key holds a NUL character; remove it")
        level = inside
    if level:
        raise _too_deep(place.document)
    return values


def _too_deep(shown: str) -> InputError:
    return InputError(f"{shown}: nested too deeply; write fewer tables inside tables")


def _parsed(text: str, shown: str) -> dict[str, Any]:
    if _DEEP_KEY.search(text):
        raise _too_deep(shown)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        place = _PLACE.search(message)
        line = place.group(1) if place and place.group(1) else str(len(text.splitlines()) or 1)
        raise InputError(f"{shown}: line {line}: {_PLACE.sub('', message)[:200]}; mend the TOML there") from None
    except RecursionError:
        raise _too_deep(shown) from None
    except ValueError:  # Python reads no whole number of more than 4300 digits
        number = _LONG_NUMBER.search(text)
        line = f"line {text.count(chr(10), 0, number.start()) + 1}: " if number else ""
        raise InputError(f"{shown}: {line}a number of too many digits; write it like 1.0e9") from None


def _text(path: Path, shown: str) -> str:
    raw = read_bytes(path, shown, "TOML file", _MOST_BYTES)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(f"{shown}: line {line}: not UTF-8 text; save the file as UTF-8") from None
