"""Markdown of generated pages: tables, and plain text that markup leaves alone."""

import re
from collections.abc import Iterable, Sequence

_MARKUP = re.compile(r"([\\`*_{}\[\]<>$|#~])")
_CODE = re.compile(r"`([^`]+)`")


def plain(text: str) -> str:
    """Text that says what it says; code in backquotes stays code."""
    parts = _CODE.split(" ".join(text.split()))
    return "".join(code(part) if place % 2 else _MARKUP.sub(r"\\\1", part) for place, part in enumerate(parts))


def code(text: str) -> str:
    """A piece of code, nothing for nothing; a bar would end the cell of a table."""
    return f"`{text}`".replace("|", "\\|") if text else ""


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are Markdown already."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def number(value: float | None) -> str:
    """A number in few digits, nothing where there is none."""
    return "" if value is None else f"{value:.6g}"


def page(title: str, *parts: str) -> str:
    """A page of a title and its parts."""
    return "\n\n".join([f"# {title}", *(part.strip("\n") for part in parts)]) + "\n"
