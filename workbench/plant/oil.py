"""The oil of a chamber: a liquid down to where it is saturated with gas, and below that liquid and gas together.

A chamber's state s [Pa] is its pressure while the oil is a liquid. Below saturation it goes on as if the oil bore
tension, and so counts the volume that the oil leaves empty: gas comes out of solution and fills that, and the pressure
is the gas's. With the volume w of oil and gas per volume of oil, the bulk modulus K, the flow Q of oil into the chamber
and the volume V that the piston sweeps,

    s' = K w/V (w Q - V'),  w = 1 + r/beta,  p = s + r - p1 + pv + g/(r/beta + g/(p1 - pv))

where the tension r is 0 above the saturation pressure ps and p1 - s well below it; between lies a knee of 0.2 bar. The
volume V/w of the oil is kept: (V/w)' = Q. The gas is that of a discrete cavity (Wylie, Streeter, Fluid Transients in
Systems, Prentice Hall 1993, ch. 8): its partial pressure p - pv times its volume is constant, g = gas content times
1 atm. What of it is dissolved at p1 is left out (Henry), so that w = 1 there.
"""

from dataclasses import dataclass

import casadi as ca

from ..rigs.oil import ATMOSPHERE, GAS_CONTENT, VAPOUR_PRESSURE
from .assembly import Assembly
from .gas import Filling, filling


@dataclass(frozen=True)
class Chamber(Filling):
    """Symbols of a chamber: its state's name, and what fills it."""

    name: str


def above_vacuum(b: Assembly) -> ca.SX:
    """The absolute pressure [Pa] where this rig counts 0: `rigs.oil.saturation` says why."""
    return ca.fmax(ATMOSPHERE - b["Pr"], 0)


def oil(b: Assembly) -> dict[str, ca.SX]:
    """The numbers of the rig's oil, as `filling` takes them."""
    return {
        "saturation": ATMOSPHERE - above_vacuum(b),
        "vapour": b.get("Pv", VAPOUR_PRESSURE),
        "gas": b.get("gas", GAS_CONTENT),
        "beta": b["beta"],
    }


def chamber(b: Assembly, name: str, scale: float, start: float = 0.0, follows: str = "") -> Chamber:
    """Declare a chamber's state [Pa], large at `scale` and starting at `start`; a line `follows` its chamber's."""
    s = b.state(name, "Pa", scale, start, follows=follows, parted=bool(follows))
    full = filling(s, **oil(b))
    return Chamber(full.pressure, full.room, full.liquid, name)


def continuity(
    b: Assembly,
    into: Chamber,
    flow: ca.SX,
    volume: ca.SX,
    swept: ca.SX | float = 0.0,
    modulus: ca.SX | None = None,
    hose: ca.SX | None = None,
) -> None:
    """The rate of a chamber's state: flow [m^3/s] of oil into it, its volume [m^3] and that one's rate `swept` [m^3/s].

    Its oil has a `modulus` [Pa] while it is a liquid (default: beta); a hose adds a compliance [m^3/Pa].
    """
    beta = b["beta"]
    stiff = beta if modulus is None else beta + (modulus - beta) * into.liquid
    grown = into.grown(flow, swept)
    if hose is None:
        b.rate(into.name, stiff * grown / volume)
    else:
        b.rate(into.name, grown / (volume / stiff + hose * into.liquid))
