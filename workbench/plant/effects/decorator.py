"""How an effect is written, in the library and in a user's own file: a function, with `effect` above it."""

import re
from collections.abc import Callable, Iterable, Mapping
from inspect import signature
from typing import Any

from ...base.errors import InputError, nearest
from ...base.units import to_si
from ...rigs.rig import Rig
from .effect import EQUATIONS, Effect, EffectNumber, EffectState, Scope
from .slots import SLOTS

Law = Callable[[Any, Scope], Any]
"""Takes what passes through a slot and the scope, returns what passes on."""

_NAME = re.compile(r"[a-z]\w*(\.[a-z]\w*)+")


def number(
    name: str,
    typical: float,
    si: str,
    *,
    low: float,
    high: float,
    meaning: str,
    off: float | None = None,
    shown: str = "",
    dry: bool = False,
    tried: tuple[float, ...] = (),
    given: bool = False,
    refines: bool = False,
    at_least: str = "",
) -> EffectNumber:
    """A number of an effect, all values in the SI unit `si`; `shown` is the unit for people, the same if left out.

    `off` is the value at which the effect is gone; a number that only shapes it has none. `tried`: further values from
    which a search starts, for a number that no fit finds from far away, as a frequency. A fit leaves a `given` one.
    `refines` marks those of a refinement. `at_least` names a number of the effect below which physics does not put it.
    """
    return EffectNumber(name, si, shown or si, typical, low, high, meaning, dry, off, tried, given, refines, at_least)


def state(
    name: str,
    si: str,
    scale: float,
    start: float = 0.0,
    memory: bool = False,
    follows: str = "",
    of: str = "",
    across: tuple[str, ...] = (),
) -> EffectState:
    """A state of an effect: SI unit, a magnitude that is large for it, a plausible start value.

    `memory`: it stays where it was until something drags it along. `follows` names the plant's state that it comes to
    where nothing moves, and starts at, as what is measured late does. `of` names a slot that not every plant has: the
    state is there with it. `across` names its speed's state and the number that is the width of a gap about 0 in which
    nothing holds it: see `Plant.gaps`.
    """
    return EffectState(name, si, scale, start, memory, follows, of, across)


def effect(
    name: str,
    formula: str,
    *,
    equation: str,
    slot: str,
    source: str,
    shows: str,
    numbers: tuple[EffectNumber, ...] = (),
    states: tuple[EffectState, ...] = (),
    family: str = "",
    also: Mapping[str, Law] | None = None,
    kinds: tuple[str, ...] = (),
    elsewhere: str = "",
    described: str = "",
    usual: Callable[[Rig], Mapping[str, float]] | None = None,
    alike: str = "",
) -> Callable[[Law], Effect]:
    """Makes an effect of the function below it, which is its law in `slot`; `also` are laws in further slots, `kinds`
    those of valve on whose rigs alone it is sought and `elsewhere` what the others have in its stead, `described` a
    number by which some rigs describe it already, `usual` numbers that fit a rig better than typical ones, `alike` a
    family that explains nearly all that it does. A law that calls what it is given `_` does without, and acts first.

    Raises InputError for a name, equation, slot or number that cannot be.
    """

    def declare(law: Law) -> Effect:
        laws = {slot: law, **(also or {})}
        free = {"kinds": kinds, "elsewhere": elsewhere, "described": described, "usual": usual}
        anew = next(iter(signature(law).parameters)) == "_"
        new = Effect(
            name, formula, equation, source, shows, laws, numbers, states, family=family, alike=alike, anew=anew, **free
        )
        check(new)
        return new

    return declare


def check(of: Effect) -> None:
    """Raises InputError for what cannot be: a bad name, an unknown equation or slot, numbers outside their range."""
    if not _NAME.fullmatch(of.name):
        raise InputError(f'effect name "{of.name}": write it like "my.drag", lower case, with a dot')
    if of.equation not in EQUATIONS:
        raise InputError(f'{of.title}: no equation "{of.equation}"; {nearest(of.equation, EQUATIONS)}')
    for slot in of.laws:
        if slot not in SLOTS:
            raise InputError(f'{of.title}: no slot "{slot}"; {nearest(slot, SLOTS)}')
    names = [entry.name for entry in (*of.numbers, *of.states)]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{of.title}: {name} is there twice")
    for each in of.numbers:
        try:
            to_si(1.0, each.shown, each.si)
        except InputError as error:
            raise InputError(f"{of.title}: {each.name}: {error}") from None
        inside = [each.typical] if each.off is None else [each.typical, each.off]
        if not all(each.low <= value <= each.high for value in inside):
            raise InputError(f"{of.title}: {each.name}: typical and off must lie between low and high")


def declared(values: Iterable[Any]) -> tuple[Effect, ...]:
    """The effects among the values of a module, in order."""
    return tuple(value for value in values if isinstance(value, Effect))
