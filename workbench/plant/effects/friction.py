"""Dry friction: of the jack's seals and bearings (jack.friction) and of the main spool in its bore (main.stiction).

Force [N] against the velocity v [m/s], beside the viscous force that the base plant has. One set of formulas serves
both; they differ in the speed over which the Coulomb step is spread and in what is typical.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from .effect import Effect, EffectNumber, EffectState, Scope

_ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30(7), 1994"
_CANUDAS = "Canudas de Wit et al., IEEE Trans. Automatic Control 40(3), 1995, eqs. 1-4, sigma0 = Fc/d, sigma1 = Fc td/d"

_Law = Callable[[Any, Scope], Any]


@dataclass(frozen=True)
class _Rubbing:
    """What rubs: names, creep speed [m/s], typical and highest Coulomb force [N], Stribeck speed [m/s], bristle [m]."""

    name: str
    slot: str
    equation: str
    family: str
    shows: str
    creep: float
    typical: float
    highest: float
    stribeck: tuple[float, float, float]
    bristle: tuple[float, float, float]


_JACK = _Rubbing(
    "jack.friction",
    "friction",
    "force",
    "",
    "slow triangles with reversals, and starts from rest",
    creep=2e-3,
    typical=800.0,
    highest=2e4,
    stribeck=(0.02, 1e-3, 0.5),
    bristle=(4e-5, 1e-6, 1e-3),
)
_SPOOL = _Rubbing(
    "main.stiction",
    "main_friction",
    "main",
    "spool stick",
    "slow triangles of the command, and small steps about a held opening, with current and spool recorded",
    creep=2e-4,
    typical=800.0,
    highest=8e3,
    stribeck=(5e-3, 2e-4, 0.2),
    bristle=(2e-6, 1e-7, 1e-4),
)


def _peak(velocity: ca.SX, s: Scope) -> ca.SX:
    """exp(-(v/vs)^2): how much of the break-away force is left."""
    ratio = velocity / s.p("vs")
    return ca.exp(-ratio * ratio)


def _coulomb(creep: float) -> _Law:
    def law(force: ca.SX, s: Scope) -> ca.SX:
        """F = Fc tanh(v/v0)."""
        return force + s.p("Fc") * ca.tanh(s["velocity"] / creep)

    return law


def _stribeck(creep: float) -> _Law:
    def law(force: ca.SX, s: Scope) -> ca.SX:
        """F = [Fc + (Fs - Fc) exp(-(v/vs)^2)] tanh(v/v0)."""
        level = s.p("Fc") + (s.p("Fs") - s.p("Fc")) * _peak(s["velocity"], s)
        return force + level * ca.tanh(s["velocity"] / creep)

    return law


def _lugre(force: ca.SX, s: Scope) -> ca.SX:
    """F = Fc (z + td z'), d z' = v - |v| z/g, g = 1 + (ratio - 1) exp(-(v/vs)^2).

    The published LuGre model with its bristle measured in d, the deflection at which it carries Fc: it has no
    quotient of forces, so that Fc may be 0.
    """
    v, z = s["velocity"], s.x("z")
    level = 1 + (s.p("ratio") - 1) * _peak(v, s)
    rate = (v - ca.fabs(v) * z / level) / s.p("d")
    s.rate("z", rate)
    return force + s.p("Fc") * (z + s.p("td") * rate)


def _formulas(of: _Rubbing) -> tuple[Effect, ...]:
    coulomb = EffectNumber("Fc", "N", "N", of.typical, 0.0, of.highest, "Coulomb friction", dry=True, off=0.0)
    static = EffectNumber(
        "Fs", "N", "N", 1.5 * of.typical, 0.0, 2 * of.highest, "break-away friction", dry=True, off=0.0
    )
    stribeck = EffectNumber("vs", "m/s", "mm/s", *of.stribeck, "Stribeck speed")
    bristle = (
        EffectNumber("ratio", "1", "1", 1.5, 1.0, 4.0, "break-away over Coulomb friction"),
        stribeck,
        EffectNumber("d", "m", "um", *of.bristle, "deflection at which the bristles carry Fc"),
        EffectNumber("td", "s", "ms", 1e-3, 0.0, 1e-2, "damping time of the bristles"),
    )

    def effect(
        formula: str,
        source: str,
        law: _Law,
        numbers: tuple[EffectNumber, ...],
        states: tuple[EffectState, ...] = (),
    ) -> Effect:
        laws = {of.slot: law}
        return Effect(of.name, formula, of.equation, source, of.shows, laws, numbers, states, family=of.family)

    return (
        effect("coulomb", _ARMSTRONG, _coulomb(of.creep), (coulomb,)),
        effect("stribeck", _ARMSTRONG, _stribeck(of.creep), (coulomb, static, stribeck)),
        effect("lugre", _CANUDAS, _lugre, (coulomb, *bristle), (EffectState("z", "1", 1.0),)),
    )


SPOOL, JACK = _formulas(_SPOOL), _formulas(_JACK)
