"""The effects that a rig may lack, and one of them as its file declares it."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from ...base.errors import check_known
from ...base.units import from_si, to_si
from ...rigs.number import Number
from ...rigs.rig import EffectUse, Rig
from .effect import Effect, EffectNumber
from .known import acts, known_effects


def effects_for(rig: Rig, files: Sequence[str | Path] = (), without: Sequence[str] = ()) -> tuple[Effect, ...]:
    """Effects of the library, of the rig and of files that act on it, less those it declares, those in `without`,
    and those that a family of others explains nearly as well.

    Raises InputError for a name in `without` that there is not.
    """
    known = known_effects(dict.fromkeys((*rig.effect_files, *map(str, files))))
    check_known("--without", without, {effect.name for effect in known}, "effect")
    gone = {*without, *(use.name for use in rig.effects)}
    return tuple(effect for effect in known if effect.name not in gone and not effect.alike and acts(effect, rig))


def effects_alike(rig: Rig, kin: str, without: Sequence[str] = ()) -> tuple[Effect, ...]:
    """The effects that act on a rig and that a family of others, `kin`, explains nearly as well, less those it declares
    and those in `without`."""
    gone = {*without, *(use.name for use in rig.effects)}
    known = known_effects(rig.effect_files)
    return tuple(effect for effect in known if effect.alike == kin and effect.name not in gone and acts(effect, rig))


def effect_use(effect: Effect, values: Mapping[str, float], source: str) -> EffectUse:
    """The effect as a rig file declares it, with values SI by name; a number without one is typical."""
    every = [values.get(number.name, number.typical) for number in effect.numbers]
    return EffectUse(effect.name, effect.formula, dict(_numbers(effect.numbers, every, source)))


def _numbers(specs: Sequence[EffectNumber], values: Sequence[float], source: str) -> Iterable[tuple[str, Number]]:
    for spec, value in zip(specs, values, strict=True):
        said = "typical; given, not fitted" if spec.given else source
        yield spec.name, Number(spec.name, _inside(spec, value), spec.shown, spec.si, said)


def _inside(spec: EffectNumber, value: float) -> float:
    """The value, moved by its last digits where a file that gives it in `shown` would read back beyond the range."""
    for step in (0.0, 1e-13, 1e-12):
        moved = value + step * (spec.high - spec.low) * (1 if value < (spec.low + spec.high) / 2 else -1)
        text = f"{float(from_si(moved, spec.shown, spec.si)):.14g}"
        if spec.low <= float(to_si(float(text), spec.shown, spec.si)) <= spec.high:
            return moved
    return value
