"""jack.friction: seals and bearings of the jack. Force [N] against the velocity [m/s], added to the viscous b v."""

import casadi as ca

from .effect import Effect, EffectNumber, EffectState, Scope

_CREEP = 2e-3  # m/s: the Coulomb step is spread over this speed

_SHOWS = "slow triangles with reversals, and starts from rest"
_COULOMB = EffectNumber("Fc", "N", "N", 800.0, 0.0, 2e4, "Coulomb friction", dry=True, off=0.0)
_STATIC = EffectNumber("Fs", "N", "N", 1200.0, 0.0, 4e4, "break-away friction", dry=True, off=0.0)
_STRIBECK = EffectNumber("vs", "m/s", "m/s", 0.02, 1e-3, 0.5, "Stribeck speed")


def _coulomb(force: ca.SX, s: Scope) -> ca.SX:
    """F = Fc tanh(v / v0), v0 = 2 mm/s."""
    return force + s.p("Fc") * ca.tanh(s["velocity"] / _CREEP)


def _stribeck_level(s: Scope) -> ca.SX:
    ratio = s["velocity"] / s.p("vs")
    return s.p("Fc") + (s.p("Fs") - s.p("Fc")) * ca.exp(-ratio * ratio)


def _stribeck(force: ca.SX, s: Scope) -> ca.SX:
    """F = [Fc + (Fs - Fc) exp(-(v/vs)^2)] tanh(v / v0)."""
    return force + _stribeck_level(s) * ca.tanh(s["velocity"] / _CREEP)


def _lugre(force: ca.SX, s: Scope) -> ca.SX:
    """z' = v - sigma0 |v| z / g(v), F = sigma0 z + sigma1 z'; g is the Stribeck level."""
    v, z = s["velocity"], s.x("z")
    stiffness = s.p("sigma0")
    rate = v - stiffness * ca.fabs(v) / _stribeck_level(s) * z
    s.rate("z", rate)
    return force + stiffness * z + s.p("sigma1") * rate


EFFECTS = (
    Effect(
        "jack.friction",
        "coulomb",
        "force",
        "Armstrong-Helouvry et al., Automatica 30(7), 1994",
        _SHOWS,
        {"friction": _coulomb},
        (_COULOMB,),
    ),
    Effect(
        "jack.friction",
        "stribeck",
        "force",
        "Armstrong-Helouvry et al., Automatica 30(7), 1994",
        _SHOWS,
        {"friction": _stribeck},
        (_COULOMB, _STATIC, _STRIBECK),
    ),
    Effect(
        "jack.friction",
        "lugre",
        "force",
        "Canudas de Wit et al., IEEE Trans. Automatic Control 40(3), 1995, eqs. 1-4",
        _SHOWS,
        {"friction": _lugre},
        (
            EffectNumber("Fc", "N", "N", 800.0, 1.0, 2e4, "Coulomb friction", off=1.0),
            EffectNumber("Fs", "N", "N", 1200.0, 1.0, 4e4, "break-away friction", off=1.0),
            _STRIBECK,
            EffectNumber("sigma0", "N/m", "N/um", 2e7, 1e5, 1e9, "bristle stiffness", dry=True),
            EffectNumber("sigma1", "N s/m", "N s/m", 2e4, 0.0, 1e6, "bristle damping", dry=True),
        ),
        (EffectState("z", "m", 1e-4),),
    ),
)
