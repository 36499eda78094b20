"""supply.sag: the pressure at the valve falls with the flow that it draws. State `drop` [Pa] below the declared Ps.

Line and manifold are a first-order lag of the drop, so that a resistance of 0 leaves the declared supply.
"""

from functools import partial

import casadi as ca

from .author import effect, number, state
from .effect import Scope

_BAND = 5e5  # Pa: a pressure-compensated pump goes from no to full delivery over about this much
_ADIABATIC = 1.4
_TAU = number("tau", 5e-3, "s", shown="ms", low=1e-4, high=1.0, meaning="time constant of line and manifold")


def _sagged(supply: ca.SX, s: Scope) -> ca.SX:
    """P = Ps - drop."""
    return supply - s.x("drop")


_sag = partial(
    effect,
    "supply.sag",
    equation="flow",
    slot="supply_flow",
    also={"supply": _sagged},
    shows="large fast moves one after the other, with supply recorded",
    states=(state("drop", "Pa", 1e6),),
)


@_sag(
    "laminar",
    source="Watton, Fundamentals of Fluid Power Control, Cambridge 2009: lumped line",
    numbers=(
        number("R", 3e8, "Pa s/m^3", shown="bar min/l", low=0.0, high=1e10, off=0.0, meaning="resistance of the line"),
        _TAU,
    ),
)
def laminar(_: None, s: Scope) -> None:
    """tau drop' = R Q - drop: laminar line, tau = R V/beta with the manifold's volume V."""
    s.rate("drop", (s.p("R") * s["flow"] - s.x("drop")) / s.p("tau"))


@_sag(
    "orifice",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3: turbulent orifice",
    numbers=(
        number(
            "k",
            3e10,
            "Pa s^2/m^6",
            shown="bar min^2/l^2",
            low=0.0,
            high=1e13,
            off=0.0,
            meaning="drop over square of flow",
        ),
        _TAU,
    ),
)
def turbulent(_: None, s: Scope) -> None:
    """tau drop' = k Q^2 - drop: turbulent line or orifice."""
    s.rate("drop", (s.p("k") * s["flow"] * s["flow"] - s.x("drop")) / s.p("tau"))


@_sag(
    "accumulator",
    source="Watton, Fundamentals of Fluid Power Control, Cambridge 2009: gas accumulator",
    numbers=(
        number(
            "g",
            100.0,
            "1/m^3",
            shown="1/l",
            low=0.0,
            high=1e5,
            off=0.0,
            meaning="inverse of the gas volume at Ps",
        ),
        number("Qmax", 3e-3, "m^3/s", shown="l/min", low=1e-5, high=0.1, meaning="largest flow of the pump"),
    ),
)
def accumulator(_: None, s: Scope) -> None:
    """drop' = g n P (P/Ps)^(1/n) (Q - Qpump), P = Ps - drop, Qpump = Qmax tanh(drop/5 bar), n = 1.4.

    Gas of an accumulator, adiabatic, refilled by a compensated pump that can not give more than Qmax.
    """
    drop = s.x("drop")
    full = s["supply"] + drop
    share = ca.fmax(s["supply"] / full, 1e-3)
    pump = s.p("Qmax") * ca.tanh(drop / _BAND)
    stiffness = s.p("g") * _ADIABATIC * full * share ** (1 + 1 / _ADIABATIC)
    s.rate("drop", stiffness * (s["flow"] - pump))
