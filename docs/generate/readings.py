"""What the readers of TOML files ask of each key: they are watched while they read a file that has every key."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeAlias
from unittest.mock import patch

from workbench.base.table import ConfigTable
from workbench.base.units import Spec

Path: TypeAlias = tuple[str, ...]
Arguments = Mapping[str, Any]
_LARGE = 1e12  # a bound from here on is none
_NAMED = ("scenario", "variation", "controllers", "sensors", "signals", "sessions", "drifts")  # tables of tables
_OPEN = (
    "within",
    "from",
    "bounds",
    "factors",
    "values",
    "jack",
    "variations",
)  # tables whose keys are names of other things
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
        first, *rest = path
        named = first in _NAMED and any(first == other for other, *_ in self._deep)
        return ".".join((first, "NAME", *rest[1:]) if named and rest else path)

    @property
    def _deep(self) -> list[Path]:
        return [path for path in self.lines if len(path) > 2]

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
    watch = _Watch()
    with ExitStack() as stack:
        for name, words in WORDS.items():
            stack.enter_context(patch.object(ConfigTable, name, watch.asking(getattr(ConfigTable, name), words)))
        stack.enter_context(patch.object(ConfigTable, "allow", watch.allowing(ConfigTable.allow)))
        yield watch.documents


class _Watch:
    """What stands in the place of a table's methods: it notes what is asked, and asks the table."""

    def __init__(self) -> None:
        self.documents: dict[str, Readings] = {}
        self._inside = False  # of a method, whose own questions are no reader's

    def asking(self, method: Callable[..., Any], words: Callable[[Arguments], str]) -> Callable[..., Any]:
        """In the place of a method that gives a key's value."""
        parameters = inspect.signature(method)

        def asked(table: ConfigTable, *args: Any, **named: Any) -> Any:
            if self._inside:
                return method(table, *args, **named)
            bound = parameters.bind(table, *args, **named)
            bound.apply_defaults()
            self._note(table, bound.arguments, words)
            self._inside = True
            try:
                return method(table, *args, **named)
            finally:
                self._inside = False

        return asked

    def allowing(self, method: Callable[..., ConfigTable]) -> Callable[..., ConfigTable]:
        """In the place of `allow`."""

        def allow(table: ConfigTable, *known: str) -> ConfigTable:
            self._of(table).allowed.setdefault(without_places(table.place.path), set()).update(known)
            return method(table, *known)

        return allow

    def _note(self, table: ConfigTable, arguments: Arguments, words: Callable[[Arguments], str]) -> None:
        readings, key = self._of(table), arguments["key"]
        if key in table.values:
            spec = arguments.get("spec")
            path = (*without_places(table.place.path), key)
            readings.asked.setdefault(path, (words(arguments), spec.meaning if spec else ""))

    def _of(self, table: ConfigTable) -> Readings:
        """What is known of a table's document."""
        readings = self.documents.setdefault(table.place.document, Readings())
        if not readings.lines:
            for path, line in table.place.lines().items():
                readings.lines.setdefault(without_places(path), line)
        return readings


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


WORDS: dict[str, Callable[[Arguments], str]] = {
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
