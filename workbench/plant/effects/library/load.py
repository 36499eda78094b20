"""load.bias and load.spring: forces on what the jack moves that the rig file does not declare.

Position is from mid stroke; forces are against positive motion, as the load cell's.
"""

from functools import partial

import casadi as ca

from ..decorator import effect, number
from ..effect import Scope

_BIAS = number("F", 5e3, "N", shown="kN", low=-1e5, high=1e5, off=0.0, meaning="constant force against positive motion")
_K = number("k", 1e5, "N/m", shown="kN/m", low=0.0, high=1e7, off=0.0, meaning="stiffness")
_K3 = number("k3", 1e7, "N/m^3", shown="MN/m^3", low=0.0, high=1e10, off=0.0, meaning="cubic stiffness")
_X0 = number("x0", 0.0, "m", shown="mm", low=-0.5, high=0.5, meaning="position from mid stroke at which it is slack")

_bias = partial(
    effect,
    "load.bias",
    equation="force",
    source="Newton's second law of the moving mass",
    shows="standing still at null, with both pressures recorded; the load cell tells the two formulas apart",
    numbers=(_BIAS,),
)
_spring = partial(
    effect,
    "load.spring",
    equation="force",
    slot="load",
    shows="standing still at several positions, with both pressures or force recorded",
)


@_bias("weight", slot="body_force")
def weight(force: ca.SX, s: Scope) -> ca.SX:
    """F on the moving mass itself, as its weight or a side load: the load cell, behind the mass, does not feel it."""
    return force + s.p("F")


@_bias("preload", slot="load")
def preload(force: ca.SX, s: Scope) -> ca.SX:
    """F through the load cell, as a weight that hangs on it."""
    return force + s.p("F")


@_spring(
    "linear",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6: spring load",
    numbers=(_K, _X0),
)
def linear(force: ca.SX, s: Scope) -> ca.SX:
    """k (x - x0), through the load cell, as the specimen that a rig file can declare."""
    return force + s.p("k") * (s["position"] - s.p("x0"))


@_spring("hardening", source="Kovacic, Brennan, The Duffing Equation, Wiley 2011, ch. 1", numbers=(_K, _K3, _X0))
def hardening(force: ca.SX, s: Scope) -> ca.SX:
    """k (x - x0) + k3 (x - x0)^3, through the load cell."""
    away = s["position"] - s.p("x0")
    return force + (s.p("k") + s.p("k3") * away * away) * away
