"""What the readers of TOML files ask of each key: they are watched while they read a file that has every key."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

from workbench.base.table import Table
from workbench.base.units import Spec

Path = tuple[str, ...]
Arguments = Mapping[str, Any]
_LARGE = 1e12  # a bound from here on is none
_NAMED = ("scenario", "variation", "controllers", "sensors", "signals", "sessions", "drifts")  # tables of tables
_OPEN = ("draw", "from", "bounds", "factors", "values")  # tables whose keys are names of other things
_ELSEWHERE = {"controllers": 2, "plant": 1}  # how deep a table is told here; other pages tell the rest


@dataclass
class Readings:
    """What was asked of the keys of one document, by path: in words, with the meaning that the code gives; the keys
    that a table may have; the line of each key."""

    asked: dict[Path, tuple[str, str]] = field(default_factory=dict)
    allowed: dict[Path, set[str]] = field(default_factory=dict)
    lines: dict[Path, int] = field(default_factory=dict)

    @property
    def shown(self) -> set[Path]:
        """The paths that are a row: no parts of a number, and no table that stands on the line of one inside it."""
        paths = {path for path in self.lines if not self.is_elsewhere(path)}
        inner = {(path[:end], self.lines[path]) for path in paths for end in range(1, len(path))}
        return {path for path in paths if path in self.asked or (path, self.lines[path]) not in inner}

    def named(self, path: Path) -> str:
        """A key path in which the name of a scenario, a signal, ... is NAME."""
        tables = {other[0] for other in self.lines if len(other) > 2 and other[0] in _NAMED}
        own = path[0] in tables and len(path) > 1
        return ".".join((path[0], "NAME", *path[2:]) if own else path)

    def is_elsewhere(self, path: Path) -> bool:
        """Whether a key is a part of a number, a name of something else, or has a page of its own."""
        inside = any(part in _OPEN for part in path[:-1]) or path[:-1] in self.asked
        return inside or len(path) > _ELSEWHERE.get(path[0], len(path))


def without_places(path: tuple[str | int, ...]) -> Path:
    """A key path without the places in lists."""
    return tuple(part for part in path if isinstance(part, str))


@contextmanager
def watched() -> Iterator[dict[str, Readings]]:
    """Readings by document, of all files that are read inside."""
    documents: dict[str, Readings] = {}
    depth = [0]

    def of(table: Table) -> tuple[Readings, Path]:
        readings = documents.setdefault(str(table.place.document), Readings())
        if not readings.lines:
            readings.lines = {without_places(path): line for path, line in reversed(table.place.lines().items())}
        return readings, without_places(table.place.path)

    def asking(name: str, words: Callable[[Arguments], str]) -> Callable[..., Any]:
        original = getattr(Table, name)

        def method(self: Table, *args: Any, **named: Any) -> Any:
            bound = inspect.signature(original).bind(self, *args, **named)
            bound.apply_defaults()
            readings, path = of(self)
            key = bound.arguments["key"]
            if not depth[0] and key in self.values:
                spec = bound.arguments.get("spec")
                meaning = spec.meaning if spec else ""
                readings.asked.setdefault((*path, key), (words(bound.arguments), meaning))
            depth[0] += 1
            try:
                return original(self, *args, **named)
            finally:
                depth[0] -= 1

        return method

    def allow(self: Table, *known: str) -> Table:
        readings, path = of(self)
        readings.allowed.setdefault(path, set()).update(known)
        return original_allow(self, *known)

    original_allow = Table.allow
    with ExitStack() as stack:
        for name, words in _WORDS.items():
            stack.enter_context(patch.object(Table, name, asking(name, words)))
        stack.enter_context(patch.object(Table, "allow", allow))
        yield documents


def _quantity(asked: Arguments) -> str:
    spec: Spec = asked["spec"]
    low = f"{spec.low:.6g}" if abs(spec.low) < _LARGE else ""
    high = f"{spec.high:.6g}" if abs(spec.high) < _LARGE else ""
    ends = f", {low} to {high}" if low and high else f", {low} or more" if low else ""
    return f"number in `{spec.unit}`{ends}"


def _in(unit: str) -> str:
    return f", in {unit}" if unit else ""


def _count(asked: Arguments) -> str:
    least, most = asked["least"], asked["most"]
    return f"whole number, {least} or more" if most >= 10**17 else f"whole number, {least} to {most}"


def _choice(asked: Arguments) -> str:
    words = list(asked["known"])
    return f"one of {', '.join(f'`{word}`' for word in words)}" if len(words) < 12 else "name of a signal"


def _range(asked: Arguments) -> str:
    above = f", above {asked['above']:g}" if asked["above"] > -_LARGE else ""
    least = f", {asked['least']:g} or more" if asked["least"] > -_LARGE else ""
    return f"`low`, `high` and `unit`, in `{asked['si']}`{above}{least}"


_WORDS: dict[str, Callable[[Arguments], str]] = {
    "text": lambda asked: "text",
    "word": _choice,
    "words": lambda asked: "list of names",
    "flag": lambda asked: "`true` or `false`",
    "count": _count,
    "number": lambda asked: "number",
    "weight": lambda asked: "number, 0 or more",
    "positive": lambda asked: f"number above 0{_in(asked['unit'])}",
    "numbers": lambda asked: "list of numbers",
    "measure": lambda asked: f"number, with `unit`, in `{asked['si']}`",
    "quantity": _quantity,
    "range": _range,
    "path": lambda asked: f"name of a {asked['suffix']} file",
}
