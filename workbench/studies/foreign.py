"""What a drawn campaign may be short of: effects of the library, formulas that it has not, and nameless causes."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..errors import InputError
from ..plant.effects import LIBRARY, Effect

BESIDE = {"main.deadband": ("flow", "main"), "drive.corrector": ("drive", "main")}
"""Equations that are right too: a lap moves the spool's flow force, a corrector the spool."""


@dataclass(frozen=True, eq=False)
class Cause:
    """An effect to draw with, and the equations in which a trace may rightly say that it sits.

    `kicked` are states that do not begin at rest, by their name in the plant. `switched`: see draw_play.Late.
    """

    effect: Effect
    equations: tuple[str, ...]
    kicked: Mapping[str, float] = field(default_factory=dict)
    switched: bool = False

    @property
    def key(self) -> tuple[str, str]:
        """Name and formula."""
        return self.effect.name, self.effect.formula


def _cause(effect: Effect) -> Cause:
    return Cause(effect, BESIDE.get(effect.name, (effect.equation,)))


OWN: tuple[Cause, ...] = tuple(_cause(effect) for effect in LIBRARY)
FOREIGN: tuple[Cause, ...] = ()
NAMELESS: tuple[Cause, ...] = ()


def cause(name: str, formula: str) -> Cause:
    """A cause by name and formula. Raises InputError."""
    for one in (*OWN, *FOREIGN, *NAMELESS):
        if one.key == (name, formula):
            return one
    raise InputError(f'nothing to draw called "{name}", "{formula}"; see workbench/studies/foreign.py')
