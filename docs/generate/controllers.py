"""Controllers and compensators: what each does, and its design numbers with unit, bounds and meaning."""

import inspect
from typing import Any

import controllers
from workbench.commands.list.catalogue import listing, number_row
from workbench.control.controller_spec import OF_THE_LOOP
from workbench.control.load_class import load_class

from .markdown import code, number, page, plain, table

_HEADS = ("number", "unit", "least", "most", "default", "meaning")

_INTRODUCTION = """A controller is a table of an experiment: `use` names its class, the other keys are its design
numbers, each as text with a unit or `{value = ..., unit = "..."}`. Compensators stand in a list inside it, the first
innermost. In Python the same numbers are arguments: `P(gain="3.7 1/m")`.

```toml
[controllers.p-dp]
use = "controllers.p:P"
gain = "3.7 1/m"
[[controllers.p-dp.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = "1.6e-4 1/bar"
corner = "0.25 Hz"
```

A number that a search may move is `{low = 1, high = 10, unit = "1/m"}`, with `log = true` where it is spread over
decades. Besides `use` and its own numbers every controller takes these, and none of them must be given:"""


def pages() -> dict[str, str]:
    """The page of the controllers."""
    rows = listing("controllers")
    parts = []
    for kind in ("controller", "compensator"):
        parts.append(f"## {kind.capitalize()}s")
        parts += [part for row in rows if row["kind"] == kind for part in _law(row)]
    return {"controllers.md": page("Controllers", _INTRODUCTION, _of_the_loop(), *parts)}


def _of_the_loop() -> str:
    """The numbers of a loop, whatever its controller."""
    return _design([number_row(entry) for entry in OF_THE_LOOP.values()], "none")


def _law(row: dict[str, Any]) -> list[str]:
    text = inspect.getdoc(load_class(row["use"], row["name"])) or ""
    return [
        f"### {row['name']}",
        _named(row["use"]),
        *(plain(part) for part in text.split("\n\n")),
        _design(row["numbers"]),
    ]


def _named(use: str) -> str:
    """How a file and how Python names a law."""
    name = use.partition(":")[2]
    return f'`use = "{use}"`' + (f"; in Python `controllers.{name}`" if name in controllers.__all__ else "")


def _design(numbers: list[dict[str, Any]], without: str = "required") -> str:
    if not numbers:
        return "It has no numbers."
    return table(
        _HEADS,
        [
            [
                code(n["name"]),
                code(n["unit"]) if n["unit"] else "",
                *("" if n[end] is None else number(n[end]) for end in ("low", "high")),
                without if n["default"] is None else number(n["default"]),
                plain(n["meaning"]),
            ]
            for n in numbers
        ],
    )
