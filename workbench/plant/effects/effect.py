"""What an effect is: a physical cause that a plant may lack, put into named slots of the graph."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca


EQUATIONS = ("drive", "pilot", "main", "flow", "force", "sensor")
"""Where a model can lack something: amplifier and spool loop, torque motor and pilot, main spool, chambers, motion."""


@dataclass(frozen=True)
class EffectNumber:
    """A number of an effect: SI unit, a typical value and the range a fit may search.

    `shown` is the unit that people read; `dry` marks a Coulomb force that a linearisation sets to zero. `off` is the
    value at which the effect is gone; a number that only shapes the effect has none.
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


@dataclass(frozen=True)
class EffectState:
    """A state that an effect adds: SI unit, magnitude, and a plausible start value."""

    name: str
    unit: str
    scale: float
    start: float = 0.0


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
    shows it. `delay` names the number by which the plant's command is late: whoever feeds the plant holds it back.
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

    def key(self, name: str) -> str:
        """The name that a number or state of this effect has inside a plant."""
        return f"{self.name}.{name}"


class Scope:
    """What a law may use: its numbers, its states, its inputs, and the quantities that the slot offers."""

    def __init__(
        self,
        effect: Effect,
        p: Mapping[str, ca.SX],
        x: Mapping[str, ca.SX],
        u: Mapping[str, ca.SX],
        rates: dict[str, ca.SX],
        context: Mapping[str, ca.SX],
    ) -> None:
        self._effect, self._p, self._x, self._u, self._rates, self._context = effect, p, x, u, rates, context

    def p(self, name: str) -> ca.SX:
        """A number of this effect."""
        return self._p[self._effect.key(name)]

    def x(self, name: str) -> ca.SX:
        """A state of this effect."""
        return self._x[self._effect.key(name)]

    def u(self, name: str) -> ca.SX:
        """An input of this effect."""
        return self._u[self._effect.key(name)]

    def rate(self, name: str, expression: ca.SX) -> None:
        """The time derivative of a state of this effect."""
        self._rates[self._effect.key(name)] = expression

    def __getitem__(self, name: str) -> ca.SX:
        """A quantity that the slot offers, such as `velocity`."""
        return self._context[name]
