"""TOML as people write it: a number with its unit on one line, tables with headers."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import tomli_w

_PLAIN = (1e-3, 1e6)  # floats of these sizes are written without an exponent


def toml_text(table: Mapping[str, Any]) -> str:
    """The text of a document, which reads back equal: keys in their order, values before tables.

    A table of plain values with a `unit` is one line, `{value = 1, unit = "m"}`; every other one has its header.
    """
    return "\n".join(_lines(table, ())).lstrip("\n") + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    for key, value in table.items():
        if not (_has_header(value) or _is_tables(value)):
            yield f"{_key(key)} = {toml_value(value)}"
    for key, value in table.items():
        inside = (*path, key)
        header = ".".join(map(_key, inside))
        if _has_header(value):
            if not value or not all(_has_header(item) for item in value.values()):
                yield f"\n[{header}]"
            yield from _lines(value, inside)
        elif _is_tables(value):
            for entry in value:
                yield f"\n[[{header}]]"
                yield from _lines(entry, inside)


def _has_header(value: Any) -> bool:
    if not isinstance(value, Mapping):
        return False
    return "unit" not in value or any(isinstance(item, Mapping) or _is_tables(item) for item in value.values())


def _is_tables(value: Any) -> bool:
    return _is_list(value) and bool(value) and all(isinstance(entry, Mapping) for entry in value)


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _key(key: str) -> str:
    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")


def toml_value(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {toml_value(item)}" for key, item in value.items()) + "}"
    if _is_list(value):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, float) and np.isfinite(value) and value and not _PLAIN[0] <= abs(value) < _PLAIN[1]:
        return np.format_float_scientific(value, trim="-", exp_digits=1).replace("e+", "e")
    return tomli_w.dumps({"a": value}).removeprefix("a = ").removesuffix("\n")
