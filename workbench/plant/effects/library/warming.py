"""oil.warming: oil that is throttled warms within a record, so that viscous friction, leakage and gain drift together.

State `warmth` [1]: how far the oil has warmed from where a record began, 1 where the valves draw their rated flow for
ever. Throttled power goes with that flow, since the supply's pressure is constant, and the oil cools with the same time
constant. A standing rig has the numbers of its rig file.
"""

from functools import partial

import casadi as ca

from ..decorator import effect, number, state
from ..effect import Scope

_Pair = tuple[ca.SX, ca.SX]

_W = number(
    "w", 3.0, "1", shown="%", low=0.0, high=20.0, off=0.0, meaning="rise of fluidity (1/viscosity) where warmth is 1"
)
_TAU = number("tau", 20.0, "s", low=1.0, high=2000.0, meaning="time constant of the oil", tried=(5.0, 80.0))


def _thinner(s: Scope) -> ca.SX:
    """Fluidity over that of the cold oil."""
    return 1 + s.p("w") * ca.fmax(s.x("warmth"), 0)


def _friction(force: ca.SX, s: Scope) -> ca.SX:
    """F + b v [1/(1 + w max(warmth, 0)) - 1], b the viscous friction of the rig."""
    return force + s["viscous"] * s["velocity"] * (1 / _thinner(s) - 1)


def _leakage(leaks: _Pair, s: Scope) -> _Pair:
    """QA + Q, QB - Q, Q = w max(warmth, 0) Cl (pA - pB), Cl the leakage of the rig."""
    more = (_thinner(s) - 1) * s["internal"] * (s["pa"] - s["pb"])
    return leaks[0] + more, leaks[1] - more


def _warms(_: None, s: Scope) -> None:
    """tau warmth' = Q/Qr - warmth."""
    s.rate("warmth", (s["flow"] / s["rated"] - s.x("warmth")) / s.p("tau"))


def _gain(flows: _Pair, s: Scope) -> _Pair:
    """QA (1 + g max(warmth, 0)), QB (1 + g max(warmth, 0))."""
    factor = 1 + s.p("g") * ca.fmax(s.x("warmth"), 0)
    return flows[0] * factor, flows[1] * factor


_warming = partial(
    effect,
    "oil.warming",
    equation="flow",
    slot="supply_flow",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 1: viscosity and density over temperature",
    shows="a long record of large moves that begins with cold oil, with both pressures recorded",
    states=(state("warmth", "1", 1.0),),
)


@_warming("viscosity", also={"friction": _friction, "leakage": _leakage}, numbers=(_W, _TAU))
def viscosity(nothing: None, s: Scope) -> None:
    """tau warmth' = Q/Qr - warmth."""
    _warms(nothing, s)


@_warming(
    "viscosity and gain",
    also={"friction": _friction, "leakage": _leakage, "line_flows": _gain},
    numbers=(
        _W,
        number("g", 0.1, "1", shown="%", low=-0.5, high=2.0, off=0.0, meaning="rise of the valve's flow there"),
        _TAU,
    ),
    kinds=("three-stage", "second-order"),
    elsewhere="no lands, whose flow would drift as the oil warms",
)
def viscosity_and_gain(nothing: None, s: Scope) -> None:
    """tau warmth' = Q/Qr - warmth."""
    _warms(nothing, s)
