"""What an effect is: a physical cause that a plant may lack, put into named slots of the graph."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True)
class EffectNumber:
    """A number of an effect: SI unit, a typical value and the range a fit may search.

    `shown` is the unit that people read; `dry` marks a Coulomb force that a linearisation sets to zero.
    """

    name: str
    si: str
    shown: str
    typical: float
    low: float
    high: float
    meaning: str
    dry: bool = False


@dataclass(frozen=True)
class EffectState:
    """A state that an effect adds: SI unit and magnitude."""

    name: str
    unit: str
    scale: float


@dataclass(frozen=True)
class Effect:
    """One formula of one effect: `laws` maps a slot to the function that changes what passes through it."""

    name: str
    formula: str
    source: str
    laws: Mapping[str, Callable[[Any, "Scope"], Any]]
    numbers: tuple[EffectNumber, ...] = ()
    states: tuple[EffectState, ...] = ()

    def key(self, name: str) -> str:
        """The name that a number or state of this effect has inside a plant."""
        return f"{self.name}.{name}"


class Scope:
    """What a law may use: its numbers, its states, and the quantities that the slot offers."""

    def __init__(
        self,
        effect: Effect,
        p: Mapping[str, ca.SX],
        x: Mapping[str, ca.SX],
        rates: dict[str, ca.SX],
        context: Mapping[str, ca.SX],
    ) -> None:
        self._effect, self._p, self._x, self._rates, self._context = effect, p, x, rates, context

    def p(self, name: str) -> ca.SX:
        """A number of this effect."""
        return self._p[self._effect.key(name)]

    def x(self, name: str) -> ca.SX:
        """A state of this effect."""
        return self._x[self._effect.key(name)]

    def rate(self, name: str, expression: ca.SX) -> None:
        """The time derivative of a state of this effect."""
        self._rates[self._effect.key(name)] = expression

    def __getitem__(self, name: str) -> ca.SX:
        """A quantity that the slot offers, such as `velocity`."""
        return self._context[name]
