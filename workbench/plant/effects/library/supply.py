"""supply.sag and supply.limit: the pressure at the valve falls with the flow that it draws, or where the pump
ends. State `drop` [Pa] below the declared Ps.

Flows are over the rated one of all valves, at full command and 70 bar, so that the numbers suit a rig of any size. Q is
what is drawn, Qo of it by another function of the same pump (0 on a rig that declares none). Line
and manifold are a first-order lag of the drop, so that a resistance of 0 leaves the declared supply.
"""

from functools import partial
from typing import Any

import casadi as ca

from ..decorator import effect, number, state
from ..effect import EffectNumber, Scope

_BAND = 5e5  # Pa: a pressure-compensated pump goes from no to full delivery over about this much
_ADIABATIC = 1.4
_STEEP = 0.05  # of rated flow, over which a pump at its end loses its pressure
_LEAST = 1e-3  # of rated flow, below which no power limiter acts
_SAG = number("sag", 5e6, "Pa", shown="bar", low=0.0, high=2e8, off=0.0, meaning="drop of the supply at rated flow")
_TAU = number("tau", 5e-3, "s", shown="ms", low=1e-4, high=1.0, meaning="time constant of line and manifold")


def _share(s: Scope) -> ca.SX:
    """Q/Qr."""
    return (s["flow"] + s["other"]) / s["rated"]


def _sagged(supply: ca.SX, s: Scope) -> ca.SX:
    """P = Ps - drop."""
    return supply - s.x("drop")


_SPOOLS: dict[str, Any] = {
    "kinds": ("three-stage", "second-order"),
    "elsewhere": "no supply that sags: its pump makes the pressure that the load asks for",
}

_sag = partial(
    effect,
    "supply.sag",
    equation="flow",
    slot="supply_flow",
    also={"supply": _sagged},
    shows="large fast moves one after the other, with supply recorded",
    states=(state("drop", "Pa", 1e6),),
    **_SPOOLS,
)


@_sag(
    "laminar",
    source="Watton, Fundamentals of Fluid Power Control, Cambridge 2009: lumped line",
    numbers=(_SAG, _TAU),
)
def laminar(_: None, s: Scope) -> None:
    """tau drop' = sag Q/Qr - drop: laminar line of resistance R = sag/Qr; tau = R V/beta, V the manifold's volume."""
    s.rate("drop", (s.p("sag") * _share(s) - s.x("drop")) / s.p("tau"))


@_sag(
    "orifice",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3: turbulent orifice",
    numbers=(_SAG, _TAU),
)
def turbulent(_: None, s: Scope) -> None:
    """tau drop' = sag (Q/Qr)^2 - drop: turbulent line or orifice."""
    share = _share(s)
    s.rate("drop", (s.p("sag") * share * share - s.x("drop")) / s.p("tau"))


@_sag(
    "accumulator",
    source="Watton, Fundamentals of Fluid Power Control, Cambridge 2009: gas accumulator",
    numbers=(
        number("rate", 2.0, "1/s", low=0.0, high=100.0, off=0.0, meaning="rated flow over the gas volume at Ps"),
        number("pump", 0.15, "1", shown="%", low=1e-3, high=1.0, meaning="largest flow of the pump over rated flow"),
    ),
)
def accumulator(_: None, s: Scope) -> None:
    """drop' = rate n P (P/Ps)^(1/n) (Q/Qr - pump tanh(drop/5 bar)), P = Ps - drop, n = 1.4.

    Gas of an accumulator, adiabatic, refilled by a compensated pump that cannot give more than its largest flow.
    """
    drop = s.x("drop")
    full = s["supply"] + drop
    left = ca.fmax(s["supply"] / full, 1e-3)
    missing = _share(s) - s.p("pump") * ca.tanh(drop / _BAND)
    s.rate("drop", s.p("rate") * _ADIABATIC * full * left ** (1 + 1 / _ADIABATIC) * missing)


_WATTON = "Watton, Fundamentals of Fluid Power Control, Cambridge 2009, ch. 2: pump characteristic"
_limit = partial(
    effect,
    "supply.limit",
    equation="flow",
    slot="supply_flow",
    also={"supply": _sagged},
    shows="long moves at several large openings up to full command, with supply or position recorded",
    states=(state("drop", "Pa", 1e6),),
    **_SPOOLS,
)


def _end(meaning: str) -> EffectNumber:
    return number(
        "share", 0.1, "1", shown="%", low=0.01, high=3.0, off=3.0, meaning=meaning, tried=(0.03, 0.25, 0.5, 1.0)
    )


@_limit("flow", source=f"{_WATTON}, full delivery", numbers=(_end("largest flow of the pump over rated flow"), _TAU))
def largest_flow(_: None, s: Scope) -> None:
    """tau drop' = (P + drop) max((Q - Qo)/Qr - max(share - Qo/Qr, 0), 0)/0.05 - drop.

    Beyond the flow that another function leaves, the pressure is gone within 5 %.
    """
    full = s["supply"] + s.x("drop")
    beyond = ca.fmax(s["flow"] / s["rated"] - ca.fmax(s.p("share") - s["other"] / s["rated"], 0), 0)
    s.rate("drop", (full * beyond / _STEEP - s.x("drop")) / s.p("tau"))


@_limit(
    "power",
    source=f"{_WATTON}, power limiter",
    numbers=(_end("largest power of the pump over that of rated flow at full pressure"), _TAU),
)
def largest_power(_: None, s: Scope) -> None:
    """tau drop' = (P + drop) max(1 - share Qr/Q, 0) - drop: the pressure falls so that P Q stays at its largest."""
    full = s["supply"] + s.x("drop")
    drawn = ca.fmax(_share(s), _LEAST)
    s.rate("drop", (full * ca.fmax(1 - s.p("share") / drawn, 0) - s.x("drop")) / s.p("tau"))
