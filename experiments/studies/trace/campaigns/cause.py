"""What a drawn campaign may be short of: effects of the library, formulas that it lacks, and unnamed causes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from workbench.base.errors import InputError
from workbench.plant.effects import Effect, EffectNumber, applies, known_effects, number_effects
from workbench.rigs.rig import Rig

from ..off_library import OTHER_FORMULAS, UNNAMED

UNSEEN = ("pilot", "main")
"""Nothing is measured between the motor's current and the main spool: either equation is right for both."""
BESIDE = {
    "main.deadband": ("flow", "main"),
    "drive.corrector": ("drive", "main"),
    "pilot.hysteresis": UNSEEN,
    "main.stiction": UNSEEN,
}
"""Equations that are right too: a lap moves the spool's flow force, a corrector the spool."""
INSIDE = ("drive", "pilot", "main")
"""Nor is anything between the command and the spool of a valve that is known by its datasheet."""
SLOW = {"drive.lag": 0.1}
"""A lag far below a period shows but in the current of the very moment at which the command is written."""
TURNING = ("pump ripple", "motor out of balance")


@dataclass(frozen=True, eq=False)
class Cause:
    """An effect to draw with, and the equations in which a trace may rightly say that it sits.

    `least` is the smallest strength over the typical one that is still of its kind. `initial_states` are those that do
    not begin at rest, by their name in the plant.
    """

    effect: Effect
    equations: tuple[str, ...]
    least: float = 1e-4
    initial_states: Mapping[str, float] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, str]:
        """Name and formula."""
        return self.effect.name, self.effect.formula


def cause(name: str, formula: str, rig: Rig) -> Cause:
    """A cause by name and formula; `rig` has the numbers that may be wrong. Raises InputError."""
    for candidate in (*LIBRARY_CAUSES, *OTHER_FORMULA_CAUSES, *UNNAMED_CAUSES, *number_causes(rig)):
        if candidate.key == (name, formula):
            inside = rig.valve == "second-order" and candidate.effect.equation in INSIDE
            return replace(candidate, equations=INSIDE) if inside else candidate
    raise InputError(f'nothing to draw called "{name}", "{formula}"; see experiments/studies/trace/off_library')


def _cause(effect: Effect) -> Cause:
    right = UNSEEN if effect.equation in UNSEEN else (effect.equation,)
    initial_states = {effect.key("cosine"): 1.0} if effect.name in TURNING else {}
    return Cause(effect, BESIDE.get(effect.name, right), SLOW.get(effect.name, 1e-4), initial_states)


LIBRARY_CAUSES: tuple[Cause, ...] = tuple(_cause(effect) for effect in known_effects() if not effect.alike)
OTHER_FORMULA_CAUSES: tuple[Cause, ...] = tuple(_cause(effect) for effect in OTHER_FORMULAS)
UNNAMED_CAUSES: tuple[Cause, ...] = tuple(_cause(effect) for effect in UNNAMED)


def causes_on(rig: Rig, pool: Sequence[Cause]) -> list[Cause]:
    """Those of a pool that the rig has room for, and does not describe already by a number of its own."""
    return [each for each in pool if applies(each.effect, rig) and each.effect.described not in rig.numbers]


def number_causes(rig: Rig) -> tuple[Cause, ...]:
    """Described numbers that are "more" or "less" than their range: typically by its width."""
    return tuple(
        Cause(replace(effect, formula=side, numbers=(number,)), (effect.equation,))
        for effect in number_effects(rig)
        for side, number in _sides(effect, rig)
    )


def _sides(effect: Effect, rig: Rig) -> list[tuple[str, EffectNumber]]:
    (by,), number = effect.numbers, rig.numbers[effect.shifts]
    assert number.low is not None
    assert number.high is not None
    width = number.high - number.low
    sides = {"more": replace(by, typical=min(width, by.high), low=0.0)}
    sides["less"] = replace(by, typical=max(-width, by.low), high=0.0)
    return [(side, number) for side, number in sides.items() if number.typical]
