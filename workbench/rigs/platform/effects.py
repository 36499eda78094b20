"""What a platform itself may show beside its jacks: friction and play of joints, and a payload that gives way."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...base.errors import InputError, nearest
from ...base.table import ConfigTable
from ...base.units import Spec
from ..number import Number, number_entry, read_number

TURNING = 2e-3  # rad/s: over which dry friction of a joint changes its sign
FRICTION, PLAY, FLEXIBLE = "joint.friction", "joint.play", "payload.flexible"
JOINT_EFFECTS: Mapping[str, Mapping[str, Spec]] = {
    FRICTION: {"moment": Spec("N m", 0.0, 1e5, "Coulomb friction of each of the leg's two joints")},
    PLAY: {
        "width": Spec("m", 0.0, 0.05, "by which the rod moves in its joint on the platform, along the leg"),
        "stiffness": Spec("N/m", 1e5, 1e11, "of the joint where it touches"),
        "damping": Spec("1", 0.0, 10.0, "damping ratio of the rod on it"),
    },
}
PAYLOAD_EFFECTS: Mapping[str, Mapping[str, Spec]] = {
    FLEXIBLE: {
        "mass": Spec("kg", 1e-3, 1e7, "the part of the payload that gives way, as a point"),
        "frequency": Spec("Hz", 0.1, 1e3, "of that part where the platform stands still, alike along all axes"),
        "damping": Spec("1", 0.0, 10.0, "its damping ratio"),
        "height": Spec("m", -100.0, 100.0, "of the point above the platform's origin; across it lies at the centre"),
    },
}

EFFECTS = {**JOINT_EFFECTS, **PAYLOAD_EFFECTS}


@dataclass(frozen=True)
class PlatformEffect:
    """One of JOINT_EFFECTS in a `leg`, counted from 1, or one of PAYLOAD_EFFECTS, leg 0; its numbers, SI."""

    name: str
    leg: int
    numbers: Mapping[str, Number]

    @property
    def label(self) -> str:
        """The name in a trace: "leg3.joint.play", "payload.flexible"."""
        return f"leg{self.leg}.{self.name}" if self.leg else self.name


def read_platform_effects(tables: Sequence[ConfigTable], legs: int) -> tuple[PlatformEffect, ...]:
    """The tables [[effects]] of a platform's file. Raises InputError with file and row."""
    effects = tuple(_read(table, legs) for table in tables)
    for place, (table, effect) in enumerate(zip(tables, effects, strict=True)):
        if effect.label in [other.label for other in effects[:place]]:
            raise table.complaint("name", f"{effect.label} is there twice; keep one")
    return effects


def _read(table: ConfigTable, legs: int) -> PlatformEffect:
    name = table.text("name")
    if name not in EFFECTS:
        raise table.complaint("name", f'a platform has no effect "{name}"; {nearest(name, EFFECTS)}')
    of_leg = name in JOINT_EFFECTS
    table.allow("name", *(["leg"] if of_leg else []), *EFFECTS[name])
    leg = table.count("leg", most=legs) if of_leg else 0
    return PlatformEffect(name, leg, {key: read_number(table, key, spec) for key, spec in EFFECTS[name].items()})


def platform_effect(name: str, leg: int = 0, **values: float) -> PlatformEffect:
    """One with SI values. Raises InputError for an unknown name or number, or an impossible value."""
    specs = EFFECTS.get(name)
    if specs is None or specs.keys() != values.keys():
        raise InputError(f"platform effect {name}: no such effect, or other numbers")
    for key, spec in specs.items():
        if problem := spec.problem(values[key]):
            raise InputError(f"platform effect {name}: {key}: {problem}")
    return PlatformEffect(
        name, leg, {key: Number(key, values[key], spec.unit, spec.unit, "given") for key, spec in specs.items()}
    )


def _entry(effect: PlatformEffect) -> dict[str, Any]:
    head = {"name": effect.name} | ({"leg": effect.leg} if effect.leg else {})
    return head | {key: number_entry(number) for key, number in effect.numbers.items()}


def effect_tables(effects: Sequence[PlatformEffect]) -> dict[str, Any]:
    """The tables [[effects]] of a platform's file; nothing where there are none."""
    return {"effects": [_entry(effect) for effect in effects]} if effects else {}
