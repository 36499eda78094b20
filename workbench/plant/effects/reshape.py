"""How a refinement is put on an effect: more numbers and states, and a law around each of its laws."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca

from .decorator import Law
from .effect import Effect, EffectNumber, EffectState, Scope
from .natural import PASSAGES, Part

SEPARATOR = "; "
Around = Callable[[str, Law], Law]
"""Takes a slot and the law in it, returns the law that takes its place."""

Change = Callable[[int, ca.SX, Scope], ca.SX]
"""Takes the index of a part that passes, the part and the scope; returns the part that takes its place."""


def put_on(
    effect: Effect,
    words: str,
    around: Around,
    numbers: Sequence[EffectNumber],
    states: Sequence[EffectState] = (),
    bends: Sequence[Mapping[str, float]] = (),
) -> Effect:
    """The effect with `around` each of its laws; its formula says so after a semicolon."""
    return replace(
        effect,
        formula=f"{effect.formula}{SEPARATOR}{words}",
        laws={slot: around(slot, law) for slot, law in effect.laws.items()},
        numbers=(*effect.numbers, *numbers),
        states=(*effect.states, *states),
        bends=(*effect.bends, *bends),
    )


def own_strengths(effect: Effect) -> tuple[EffectNumber, ...]:
    """The numbers at whose off the effect is gone, which a fit may move: none of a refinement."""
    return tuple(entry for entry in effect.fitted if entry.off is not None and not entry.refines)


def passing_parts(effect: Effect) -> Iterator[tuple[str, int, Part]]:
    """Slot, index and what is known of everything that passes through the effect's laws."""
    for slot in effect.laws:
        for index, part in enumerate(PASSAGES[slot].parts):
            yield slot, index, part


def changed_output(slot: str, law: Law, change: Change) -> Law:
    """The law with a change of what it puts in: of the whole signal, or of what it adds where things are added."""

    def reshaped(value: Any, s: Scope) -> Any:
        after = law(value, s)
        if after is None:
            return None
        if not isinstance(after, tuple):
            return changed(0, value, after, s)
        return tuple(changed(i, b, a, s) for i, (b, a) in enumerate(zip(value, after, strict=True)))

    def changed(index: int, before: ca.SX, after: ca.SX, s: Scope) -> ca.SX:
        if PASSAGES[slot].signal:
            return change(index, after, s)
        return before + change(index, after - before, s)

    return reshaped
