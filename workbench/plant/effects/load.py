"""load.bias and load.spring: forces on what the jack moves that the rig file does not declare.

Position is from mid stroke; forces are against positive motion, as the load cell's.
"""

import casadi as ca

from .effect import Effect, EffectNumber, Scope


def _constant(force: ca.SX, s: Scope) -> ca.SX:
    """F added to the force on the mass."""
    return force + s.p("F")


def _linear(force: ca.SX, s: Scope) -> ca.SX:
    """k (x - x0)."""
    return force + s.p("k") * (s["position"] - s.p("x0"))


def _hardening(force: ca.SX, s: Scope) -> ca.SX:
    """k (x - x0) + k3 (x - x0)^3."""
    away = s["position"] - s.p("x0")
    return force + (s.p("k") + s.p("k3") * away * away) * away


_STILL = "standing still at null, with both pressures recorded; the load cell tells the two formulas apart"
_PLACES = "standing still at several positions, with both pressures or force recorded"
_NEWTON = "Newton's second law of the moving mass"
_BIAS = EffectNumber("F", "N", "kN", 5e3, -1e5, 1e5, "constant force against positive motion", off=0.0)
_K = EffectNumber("k", "N/m", "kN/m", 1e5, 0.0, 1e7, "stiffness", off=0.0)
_X0 = EffectNumber("x0", "m", "mm", 0.0, -0.5, 0.5, "position from mid stroke at which it is slack")

EFFECTS = (
    Effect("load.bias", "weight", "force", _NEWTON, _STILL, {"body_force": _constant}, (_BIAS,)),
    Effect("load.bias", "preload", "force", _NEWTON, _STILL, {"load": _constant}, (_BIAS,)),
    Effect(
        "load.spring",
        "linear",
        "force",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 6.2: spring load of a piston",
        _PLACES,
        {"load": _linear},
        (_K, _X0),
    ),
    Effect(
        "load.spring",
        "hardening",
        "force",
        "Duffing's restoring force; Kovacic, Brennan, The Duffing Equation, Wiley 2011, ch. 1",
        _PLACES,
        {"load": _hardening},
        (_K, EffectNumber("k3", "N/m^3", "kN/mm^3", 1e7, 0.0, 1e10, "cubic stiffness", off=0.0), _X0),
    ),
)
