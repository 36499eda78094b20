"""What a drawn campaign may be short of: effects of the library, formulas that it lacks, and unnamed causes."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ....base.errors import InputError
from ....plant.effects import LIBRARY, Effect
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


def cause(name: str, formula: str) -> Cause:
    """A cause by name and formula. Raises InputError."""
    for candidate in (*LIBRARY_CAUSES, *OTHER_FORMULA_CAUSES, *UNNAMED_CAUSES):
        if candidate.key == (name, formula):
            return candidate
    raise InputError(f'nothing to draw called "{name}", "{formula}"; see workbench/commands/trace_study/off_library')


def _cause(effect: Effect) -> Cause:
    right = UNSEEN if effect.equation in UNSEEN else (effect.equation,)
    initial_states = {effect.key("cosine"): 1.0} if effect.name in TURNING else {}
    return Cause(effect, BESIDE.get(effect.name, right), SLOW.get(effect.name, 1e-4), initial_states)


LIBRARY_CAUSES: tuple[Cause, ...] = tuple(_cause(effect) for effect in LIBRARY)
OTHER_FORMULA_CAUSES: tuple[Cause, ...] = tuple(_cause(effect) for effect in OTHER_FORMULAS)
UNNAMED_CAUSES: tuple[Cause, ...] = tuple(_cause(effect) for effect in UNNAMED)
