"""The library of effects: each formula with its equation, its numbers, where it acts and what shows it."""

import inspect
from collections.abc import Sequence
from itertools import groupby

from workbench.plant.effects import LIBRARY, PUMP_LIBRARY, Effect, missing
from workbench.rigs.valve import VALVES

from .markdown import code, number, page, plain, table

_HEADS = ("number", "unit", "typical", "least", "most", "off", "meaning")

_INTRODUCTION = """What a rig may show and its model lacks. A rig file declares an effect by name and formula; numbers
that it leaves out are typical. "Least" and "most" are the range that a fit may search; "off" is the value at which the
effect is gone, and a number without one only shapes it. All are in SI. The equation is the part of the model that
lacks the effect, a family the effects that look alike.

```toml
[[effects]]
name = "jack.friction"
formula = "stribeck"
Fc = {value = 0.6, unit = "kN"}
```

[](../how/own_effect.md) says how to write your own."""


def pages() -> dict[str, str]:
    """The page of the effects."""
    parts = []
    for name, formulas in groupby((*LIBRARY, *PUMP_LIBRARY), key=lambda effect: effect.name):
        parts += [f"## {name}", *(part for effect in formulas for part in _formula(effect))]
    return {"effects.md": page("Effects", _INTRODUCTION, *_kinds(), *parts)}


def _kinds() -> list[str]:
    """Every effect on every kind of valve: its formulas there, or why it has none."""
    named = {
        name: list(formulas) for name, formulas in groupby((*LIBRARY, *PUMP_LIBRARY), key=lambda effect: effect.name)
    }
    rows = [[code(name), *(_there(formulas, kind) for kind in VALVES)] for name, formulas in named.items()]
    return ["## Effects and kinds of valve", table(("effect", *VALVES), rows)]


def _there(formulas: Sequence[Effect], kind: str) -> str:
    there = [effect.formula or "its formula" for effect in formulas if kind in effect.valves]
    return "; ".join(there) or f"*has {missing(formulas[0], kind)}*"


def _formula(effect: Effect) -> list[str]:
    texts = dict.fromkeys(inspect.getdoc(law) or "" for law in effect.laws.values()) or [_late(effect)]
    formulas = [text.partition("\n\n")[0] for text in texts]
    further = [part for text in texts for part in text.split("\n\n")[1:]]
    rows = [
        [code(n.name), code(n.si), number(n.typical), number(n.low), number(n.high), number(n.off), plain(n.meaning)]
        for n in effect.numbers
    ]
    family = f", family {plain(effect.family)}" if effect.family else ""
    valves = ", ".join(sorted(effect.valves))
    return [
        f"### {effect.name}: {effect.formula or 'its only formula'}",
        "```{code-block} text\n:class: wrapped\n\n" + "\n".join(formulas) + "\n```",
        *map(plain, further),
        f"Equation: {effect.equation}{family}. Valves: {valves}. Shown by {plain(effect.shows)}. "
        f"Source: {plain(effect.source)}.",
        *([table(_HEADS, rows)] if rows else []),
    ]


def _late(effect: Effect) -> str:
    """Of an effect without a law in the plant: whoever feeds it holds the command back."""
    between = ", and between two samples is interpolated" if effect.interpolated else ""
    return f"The command arrives {effect.delay} later{between}."
