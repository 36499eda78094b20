"""The effects that a rig may show and the base model lacks: one file a physical cause."""

from collections.abc import Iterable, Mapping

from ...errors import InputError, nearest
from ...rig import EffectUse, Rig
from ...units import to_si
from . import air, compliance, drive, friction, lands, leakage, load, pilot, sensor, supply
from .effect import EQUATIONS, Effect, EffectInput, EffectNumber, EffectState, Scope
from .slots import SLOTS, Slot

LIBRARY: tuple[Effect, ...] = (
    *drive.EFFECTS,
    *pilot.EFFECTS,
    *friction.SPOOL,
    *lands.EFFECTS,
    *supply.EFFECTS,
    *air.EFFECTS,
    *leakage.EFFECTS,
    *friction.JACK,
    *load.EFFECTS,
    *compliance.EFFECTS,
    *sensor.EFFECTS,
)

__all__ = [
    "EQUATIONS",
    "LIBRARY",
    "SLOTS",
    "Effect",
    "EffectInput",
    "EffectNumber",
    "EffectState",
    "Scope",
    "Slot",
    "applies",
    "find",
    "resolve",
]


def applies(effect: Effect, rig: Rig) -> bool:
    """Whether the plant of this rig has all the slots of the effect; a delay, which needs none, always applies."""
    return rig.valve in effect.valves


def find(name: str, formula: str) -> Effect:
    """An effect of the library by name and formula; an empty formula takes the name's first."""
    named = [effect for effect in LIBRARY if effect.name == name]
    if not named:
        raise InputError(f'no effect "{name}"; {nearest(name, {effect.name for effect in LIBRARY})}')
    for effect in named:
        if formula in ("", effect.formula):
            return effect
    raise InputError(f'{name}: no formula "{formula}"; {nearest(formula, [effect.formula for effect in named])}')


def resolve(uses: Iterable[EffectUse]) -> tuple[tuple[Effect, Mapping[str, float]], ...]:
    """The effects a rig declares, with their numbers in SI; a number that it does not give is the typical one."""
    uses = tuple(uses)
    names = [use.name for use in uses]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"effect {name} is declared twice; keep one formula of it")
    return tuple(_resolve(use) for use in uses)


def _resolve(use: EffectUse) -> tuple[Effect, Mapping[str, float]]:
    effect = find(use.name, use.formula)
    known = {number.name: number for number in effect.numbers}
    values = {name: number.typical for name, number in known.items()}
    for name, given in use.numbers.items():
        if name not in known:
            raise InputError(f'{use.name}: no number "{name}"; {nearest(name, known)}')
        spec = known[name]
        values[name] = float(to_si(given.value, given.unit, spec.si))
        if not spec.low <= values[name] <= spec.high:
            raise InputError(
                f"{use.name}: {name} = {values[name]:g} {spec.si} is outside {spec.low:g} to {spec.high:g} {spec.si}"
            )
    return effect, values
