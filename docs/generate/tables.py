"""Tables that studies left: a page that names one says which version made it, and when."""

import re
from typing import Any

from experiments.studies import Kept, kept

_NAMED = re.compile(r"`experiments/studies/([\w/]+)\.json`")


def setup(app: Any) -> dict[str, bool]:
    """Have every page say of its tables who made them."""
    app.connect("source-read", lambda app, name, source: source.__setitem__(0, dated(source[0], _own_version())))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def dated(page: str, version: str) -> str:
    """A page with version and date behind each table that it names. Raises ValueError for a table that is too old for
    a version of jackbench: made before the minor version that came before that."""

    def shown(match: re.Match[str]) -> str:
        table = kept(match[1])
        if _minor(table.version) < _before(version):
            raise ValueError(f"{match[0]} is by {table.version}, too old for {version}: run {table.command}")
        return f"{match[0]} ({_words(table)})"

    return _NAMED.sub(shown, page)


def _words(table: Kept) -> str:
    return f"by jackbench {table.version}, {table.date}"


def _minor(version: str) -> tuple[int, int]:
    major, minor, *_ = version.split(".")
    return int(major), int(minor)


def _before(version: str) -> tuple[int, int]:
    major, minor = _minor(version)
    return major, max(minor - 1, 0)


def _own_version() -> str:
    from importlib.metadata import version

    return version("jackbench")
