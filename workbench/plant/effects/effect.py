"""What an effect is: a physical cause that a plant may lack, put into named slots of the graph."""

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ...base.errors import InputError, nearest
from ...rigs.rig import Rig
from .slots import valves_with

EQUATIONS = ("drive", "pilot", "main", "flow", "force", "sensor")
"""Where a model can lack something: amplifier and spool loop, torque motor and pilot, main spool, chambers, motion."""


@dataclass(frozen=True)
class EffectNumber:
    """A number of an effect: SI unit, a typical value and the range a fit may search, all in SI.

    `shown` is the unit that people read; `dry` marks a Coulomb force that a linearisation sets to zero. `off` is the
    value at which the effect is gone; a number that only shapes the effect has none. `tried` are values from which a
    search starts, besides `typical`, where no fit finds the way from there: those of a frequency. `given`: recordings
    rarely tell it from the others, so that a fit leaves it where it is typical; a rig file may declare another value.
    `refines`: it is of a refinement, whose effect without it is the plain formula. `at_least` names a number of the
    effect below which physics does not put it; a fit may, and then the formula is not what the rig does.
    """

    name: str
    si: str
    shown: str
    typical: float
    low: float
    high: float
    meaning: str
    dry: bool = False
    off: float | None = None
    tried: tuple[float, ...] = ()
    given: bool = False
    refines: bool = False
    at_least: str = ""


@dataclass(frozen=True)
class EffectState:
    """A state that an effect adds: SI unit, magnitude, and a plausible start value, or the state that it `follows`.

    `memory`: it stays where it was until something drags it along, as a play does, so that a loop may hunt on it. A
    state `of` a slot is not there in a plant without this slot. `across` a gap it moves freely between impacts, with a
    state that is its speed and a number that is the gap's width.
    """

    name: str
    unit: str
    scale: float
    start: float = 0.0
    memory: bool = False
    follows: str = ""
    of: str = ""
    across: tuple[str, ...] = ()


@dataclass(frozen=True)
class EffectInput:
    """An input that an effect adds, after those of the plant: SI unit and magnitude."""

    name: str
    unit: str
    scale: float


@dataclass(frozen=True)
class Effect:
    """One formula of one effect: `laws` maps a slot to the function that changes what passes through it.

    `equation` is the one of EQUATIONS that lacks it, `family` the effects that look alike, `shows` the excitation that
    shows it. `delay` names the number by which the plant's command is late: whoever feeds the plant holds it back;
    where it is `interpolated`, the plant holds the mean over each period of what arrives in it. `kinds` are those of
    valve on whose rigs alone it is sought, without any all that have its slots; `elsewhere` is what the others have in
    its stead, to be read after "a ... valve has". `described` is a number by which some rigs describe it already: on
    these it is declared, never sought. `usual` are numbers that fit a rig better than typical ones: those of a rig that
    declares it without them. `alike` is a family that explains nearly all that it does: it is
    declared, never sought, and named beside that family. `shifts` names a number of the rig to which its first number
    is added: no effect, but a number that the rig file has wrong. `bends` are weighted sums of its numbers that are 0
    where a static curve of many numbers is straight: what tells little of them leaves it so. `anew`: what it passes on
    does not depend on what it is given, so that it acts before the others in its slot.
    """

    name: str
    formula: str
    equation: str
    source: str
    shows: str
    laws: Mapping[str, Callable[[Any, "Scope"], Any]]
    numbers: tuple[EffectNumber, ...] = ()
    states: tuple[EffectState, ...] = ()
    inputs: tuple[EffectInput, ...] = ()
    family: str = ""
    delay: str = ""
    interpolated: bool = False
    kinds: tuple[str, ...] = ()
    elsewhere: str = ""
    described: str = ""
    usual: Callable[[Rig], Mapping[str, float]] | None = None
    alike: str = ""
    shifts: str = ""
    bends: tuple[Mapping[str, float], ...] = ()
    anew: bool = False

    def key(self, name: str) -> str:
        """The name that a number or state of this effect has inside a plant."""
        return f"{self.name}.{name}"

    @property
    def kin(self) -> str:
        """The name of its family; its own where it has none."""
        return self.family or self.name

    @property
    def fitted(self) -> tuple[EffectNumber, ...]:
        """The numbers that a fit may move."""
        return tuple(number for number in self.numbers if not number.given)

    @property
    def has_memory(self) -> bool:
        """Whether one of its states is memory, or rattles: where it is in its gap is all that was before."""
        return self.rattles or any(state.memory for state in self.states)

    @property
    def rattles(self) -> bool:
        """Whether one of its states moves freely across a gap between impacts, in view of the position's sensor."""
        return "sensor_position" in self.laws and any(state.across for state in self.states)

    @property
    def title(self) -> str:
        """Name and formula, as messages give them."""
        return f"{self.name} {self.formula}".strip()

    @property
    def valves(self) -> frozenset[str]:
        """The kinds of valve whose plant has all the slots of this effect."""
        able = valves_with(self.laws)
        return able & set(self.kinds) if self.kinds else able


class Scope:
    """What a law may use: its numbers, its states, its inputs, and the quantities that the slot offers.

    Every call raises InputError for a name that is not there.
    """

    def __init__(
        self,
        effect: Effect,
        p: Mapping[str, ca.SX],
        x: Mapping[str, ca.SX],
        u: Mapping[str, ca.SX],
        rates: dict[str, ca.SX],
        context: Mapping[str, ca.SX],
    ) -> None:
        self._effect, self._rates, self._context = effect, rates, context
        self._p = {number.name: p[effect.key(number.name)] for number in effect.numbers}
        self._x = {state.name: x[effect.key(state.name)] for state in effect.states}
        self._u = {given.name: u[effect.key(given.name)] for given in effect.inputs}

    def p(self, name: str) -> ca.SX:
        """A number of this effect."""
        return self._known(self._p, name, "number")

    def x(self, name: str) -> ca.SX:
        """A state of this effect."""
        return self._known(self._x, name, "state")

    def u(self, name: str) -> ca.SX:
        """An input of this effect."""
        return self._known(self._u, name, "input")

    def with_numbers(self, values: Mapping[str, ca.SX]) -> "Scope":
        """This scope where some numbers of this effect are expressions."""
        changed = copy(self)
        changed._p = self._p | dict(values)
        return changed

    def rate(self, name: str, expression: ca.SX) -> None:
        """The time derivative of a state of this effect."""
        self._known(self._x, name, "state")
        self._rates[self._effect.key(name)] = expression

    def __getitem__(self, name: str) -> ca.SX:
        """A quantity that the slot offers, such as `velocity`."""
        return self._known(self._context, name, "quantity in this slot")

    def _known(self, of: Mapping[str, ca.SX], name: str, kind: str) -> ca.SX:
        if name not in of:
            hint = nearest(name, of) if of else "it has none"
            raise InputError(f'{self._effect.title}: no {kind} "{name}"; {hint}')
        return of[name]
