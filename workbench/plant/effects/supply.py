"""supply.sag: the pressure at the valve falls with the flow that it draws. State `drop` [Pa] below the declared Ps.

Line and manifold are a first-order lag of the drop, so that a resistance of 0 leaves the declared supply.
"""

import casadi as ca

from .effect import Effect, EffectNumber, EffectState, Scope

_BAND = 5e5  # Pa: a pressure-compensated pump goes from no to full delivery over about this much


def _sagged(supply: ca.SX, s: Scope) -> ca.SX:
    """P = Ps - drop."""
    return supply - s.x("drop")


def _laminar(_: None, s: Scope) -> None:
    """tau drop' = R Q - drop: laminar line, tau = R V/beta with the manifold's volume V."""
    s.rate("drop", (s.p("R") * s["flow"] - s.x("drop")) / s.p("tau"))


def _turbulent(_: None, s: Scope) -> None:
    """tau drop' = k Q^2 - drop: turbulent line or orifice."""
    s.rate("drop", (s.p("k") * s["flow"] * s["flow"] - s.x("drop")) / s.p("tau"))


def _accumulator(_: None, s: Scope) -> None:
    """drop' = g n P (P/Ps)^(1/n) (Q - Qpump), Qpump = Qmax tanh(drop/5 bar), n = 1.4, g = 1/(gas volume at Ps).

    Gas of an accumulator, adiabatic, refilled by a compensated pump that can not give more than Qmax.
    """
    supply, drop = s["supply"], s.x("drop")
    full = supply + drop
    share = ca.fmax(supply / full, 1e-3)
    pump = s.p("Qmax") * ca.tanh(drop / _BAND)
    s.rate("drop", s.p("g") * 1.4 * full * share ** (1 + 1 / 1.4) * (s["flow"] - pump))


_SHOWS = "large fast moves one after the other, with supply recorded"
_TAU = EffectNumber("tau", "s", "ms", 5e-3, 1e-4, 1.0, "time constant of line and manifold")
_DROP = EffectState("drop", "Pa", 1e6)

EFFECTS = (
    Effect(
        "supply.sag",
        "laminar",
        "flow",
        "Watton, Fundamentals of Fluid Power Control, Cambridge 2009, ch. 5: lumped line, resistance and capacitance",
        _SHOWS,
        {"supply": _sagged, "supply_flow": _laminar},
        (EffectNumber("R", "Pa s/m^3", "bar min/l", 3e8, 0.0, 1e10, "resistance of the line", off=0.0), _TAU),
        (_DROP,),
    ),
    Effect(
        "supply.sag",
        "orifice",
        "flow",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 3.3: turbulent orifice",
        _SHOWS,
        {"supply": _sagged, "supply_flow": _turbulent},
        (EffectNumber("k", "Pa s^2/m^6", "bar min^2/l^2", 3e10, 0.0, 1e13, "drop over flow squared", off=0.0), _TAU),
        (_DROP,),
    ),
    Effect(
        "supply.sag",
        "accumulator",
        "flow",
        "Watton, Fundamentals of Fluid Power Control, Cambridge 2009, ch. 6: gas accumulator with a pump",
        _SHOWS,
        {"supply": _sagged, "supply_flow": _accumulator},
        (
            EffectNumber("g", "1/m^3", "1/l", 100.0, 0.0, 1e5, "inverse of the gas volume at full supply", off=0.0),
            EffectNumber("Qmax", "m^3/s", "l/min", 1e-3, 1e-5, 0.1, "largest flow of the pump"),
        ),
        (_DROP,),
    ),
)
