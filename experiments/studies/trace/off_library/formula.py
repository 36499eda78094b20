"""How a foreign effect is written down: shorter than one of the library, whose name it may share."""

from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca

from workbench.plant.effects import Effect, EffectNumber, EffectState, Scope, known_effects

Law = Callable[[Any, Scope], Any]
DATASHEET = ("second-order",)
"""Kinds of valve that are known by a datasheet alone."""


def size(name: str, si: str, typical: float, high: float, meaning: str, dry: bool = False) -> EffectNumber:
    """A number by which the effect vanishes, at 0."""
    return EffectNumber(name, si, si, typical, 0.0, high, meaning, dry, off=0.0)


def shape(name: str, si: str, typical: float, meaning: str) -> EffectNumber:
    """A number that only shapes the effect, within a factor of 20 of its typical value."""
    return EffectNumber(name, si, si, typical, typical / 20, typical * 20, meaning)


def off_library(
    name: str,
    title: str,
    source: str,
    laws: Mapping[str, Law],
    numbers: tuple[EffectNumber, ...],
    states: tuple[EffectState, ...] = (),
    delay: str = "",
    kinds: tuple[str, ...] = (),
) -> Effect:
    """Another formula of an effect that the library has: same name, equation and family; on valves of these `kinds`."""
    kin = next(effect for effect in known_effects() if effect.name == name)
    own = {"family": kin.family, "delay": delay, "kinds": kinds or kin.kinds}
    return Effect(name, title, kin.equation, source, kin.shows, laws, numbers, states, **own)


def unnamed(
    name: str,
    equation: str,
    laws: Mapping[str, Law],
    numbers: tuple[EffectNumber, ...],
    states: tuple[EffectState, ...] = (),
    kinds: tuple[str, ...] = (),
) -> Effect:
    """A cause that the library has no name for."""
    source = "none: nobody published it as a servo-valve's"
    return Effect(name, "", equation, source, "", laws, numbers, states, kinds=kinds)


def oscillator(s: Scope, states: tuple[str, str], hertz: ca.SX) -> ca.SX:
    """sin(2 pi f t + phase), by two states that turn at f [Hz] and keep the amplitude that they begin with."""
    first, second = (s.x(name) for name in states)
    s.rate(states[0], 2 * ca.pi * hertz * second)
    s.rate(states[1], -2 * ca.pi * hertz * first)
    return first


def smooth_sign(value: ca.SX, width: ca.SX | float) -> ca.SX:
    """Algebraic sign: value / sqrt(value^2 + width^2)."""
    return value / ca.sqrt(value * value + width * width)
