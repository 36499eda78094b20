"""The jack, two chambers around a piston, with leakage and end stops, double-rod or differential; and what it moves: a
mass, a specimen whose far end may move, and a second cylinder that pushes back.
"""

from dataclasses import dataclass

import casadi as ca

from ..rigs.jack import JackKind
from .assembly import Assembly
from .orifice import end_stop, volume
from .valve import ValveFlows

_SLOW = 1e-3  # m/s, within which the push builds up behind a valve that tells no direction


@dataclass(frozen=True)
class Chambers:
    """Symbols of the two chambers: pressures [Pa], areas [m^2], dead volumes [m^3]."""

    pa: ca.SX
    pb: ca.SX
    area_a: ca.SX
    area_b: ca.SX
    dead_a: ca.SX
    dead_b: ca.SX

    @property
    def force(self) -> ca.SX:
        """Pressure force on the piston [N]."""
        return self.pa * self.area_a - self.pb * self.area_b


def chambers(b: Assembly, kind: JackKind, rest: float) -> Chambers:
    """Declare the chamber pressures of a jack of this kind, at rest at about `rest` [Pa]."""
    feed = b.magnitude("Ps")
    pa = b.state("P1", "Pa", feed, rest)
    pb = b.state("P2", "Pa", feed, rest)
    area_a, area_b, dead_a, dead_b = (b[name] for name in (*kind.areas, *kind.dead_volumes))
    return Chambers(pa, pb, area_a, area_b, dead_a, dead_b)


def continuity(b: Assembly, jack: Chambers, valve: ValveFlows, x: ca.SX, v: ca.SX, drain: ca.SX) -> None:
    """Pressure rates: valve flow, leakage past the piston, and the volume that it sweeps. x is 0 at mid stroke."""
    pa, pb = jack.pa, jack.pb
    across = b["Cl"] * (pa - pb)
    outside = b.slot("leakage", (ca.SX(0), ca.SX(0)), pa=pa, pb=pb, drain=drain, position=x)
    into_a = b["n"] * valve.into_a - across - jack.area_a * v - outside[0]
    into_b = jack.area_b * v + across - b["n"] * valve.out_of_b - outside[1]
    half = b["S"] / 2
    modulus_a = b.slot("modulus", b["beta"], pressure=pa)
    modulus_b = b.slot("modulus", b["beta"], pressure=pb)
    volumes = volume(jack.dead_a, jack.area_a * (half + x)), volume(jack.dead_b, jack.area_b * (half - x))
    if "ChA" in b:
        hose_a, hose_b = b.slot("hoses", (b["ChA"], b["ChB"]), pa=pa, pb=pb)
        b.rate("P1", into_a / (volumes[0] / modulus_a + hose_a))
        b.rate("P2", into_b / (volumes[1] / modulus_b + hose_b))
    else:
        b.rate("P1", modulus_a * into_a / volumes[0])
        b.rate("P2", modulus_b * into_b / volumes[1])


def rod_force(b: Assembly, jack: Chambers, x: ca.SX, v: ca.SX) -> ca.SX:
    """Force [N] that the piston gives to what it carries: pressure less friction and end stops."""
    stop = end_stop(x, v, b["S"] / 2, b["ke"], b["ce"], 1e-4)
    friction = b.slot("friction", ca.SX(0), velocity=v, position=x, drop=jack.pa - jack.pb)
    return jack.force - b["b"] * v - stop - friction


def specimen_force(b: Assembly, x: ca.SX, v: ca.SX) -> ca.SX:
    """Load-cell force [N]: ks (x - xs) + cs (v - vs) + disturbance, with the far end and the disturbance as inputs."""
    far = b.input("specimen_position", "m", 0.25)
    far_speed = b.input("specimen_velocity", "m/s", 1.0)
    disturbance = b.input("disturbance", "N", 1e4)
    plain = b["ks"] * (x - far) + b["cs"] * (v - far_speed) + disturbance
    return b.slot("load", plain, position=x, velocity=v)


def cell_forces(b: Assembly, rod: ca.SX, force: ca.SX, acceleration: ca.SX) -> dict[str, ca.SX]:
    """What a load cell reads of a force [N] at the specimen: with it, what moves the mass between the two; on the rod
    the `rod` force [N] less what moves the mass before it, and so all that moves, lifts and loads the rest."""
    if "Mr" in b:
        return {"force": rod - b["Mr"] * acceleration, "reference_force": force}
    if "Mg" in b:
        return {"force": force + b["Mg"] * acceleration, "reference_force": force}
    return {"force": force}


def loader_force(b: Assembly, valve: ValveFlows, x: ca.SX, v: ca.SX) -> ca.SX:
    """Force [N] against extension: set pressure [Pa], an input, on the area AL; none while the jack retracts."""
    full = b["AL"] * b.input("load_setting", "Pa", 1e7)
    extends = (1 + ca.tanh(v / _SLOW)) / 2 if valve.extends is None else valve.extends
    return b.slot("loader", full * extends, full=full, position=x, velocity=v)
