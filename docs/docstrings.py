"""Docstrings of the code are plain text with code in `backquotes`: words stay as they are, tables become code, and
sections of parameters definitions."""

import re
from typing import Any

_CODE = re.compile(r"`+([^`\n]+)`+")
_MARKUP = re.compile(r"([*|\\]|_\b)")
_COLUMNS = re.compile(r"\S {3,}\S")
_SECTION = re.compile(r"(\w+)\n-+\n(.*)", re.DOTALL)


def setup(app: Any) -> dict[str, bool]:
    """Have every docstring made into reStructuredText as it is read."""
    app.connect("autodoc-process-docstring", _process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _process(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    lines[:] = restructured("\n".join(lines)).splitlines()


def restructured(text: str) -> str:
    """A docstring as reStructuredText: a paragraph that is indented or in columns is a literal block."""
    return "\n\n".join(_paragraph(part) for part in re.split(r"\n\s*\n", text.strip("\n")) if part.strip()) + "\n"


def _paragraph(text: str) -> str:
    if section := _SECTION.fullmatch(text):
        rows = [_defined(row) for row in section[2].splitlines()]
        return f".. rubric:: {section[1]}\n\n" + "\n".join(rows)
    rows = text.splitlines()
    if all(row.startswith("  ") for row in rows) or any(map(_COLUMNS.search, rows)):
        return ".. code-block:: text\n\n" + "\n".join(f"    {row}" for row in rows)
    return " ".join(map(_escaped, [row.strip() for row in rows]))


def _defined(row: str) -> str:
    """A row of a section: what a thing is, or its name, kind and default."""
    if row.startswith("    "):
        return f"    {_escaped(row.strip())}"
    name, colon, kind = row.partition(" : ")
    return f"``{name}``{colon}{_escaped(kind)}"


def _escaped(row: str) -> str:
    parts = _CODE.split(row)  # words and code in turn
    return "".join(f"``{part}``" if place % 2 else _MARKUP.sub(r"\\\1", part) for place, part in enumerate(parts))
