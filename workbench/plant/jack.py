"""The jack, two chambers around a piston, with leakage and end stops, double-rod or differential; and what it moves: a
mass, a specimen whose far end may move, and a second cylinder that pushes back.
"""

from dataclasses import dataclass

import casadi as ca

from ..rigs.jack import JackKind
from .assembly import Assembly
from .oil import Chamber, chamber, continuity
from .orifice import end_stop, volume
from .valve import ValveFlows

_SLOW = 1e-3  # m/s, within which the push builds up behind a valve that tells no direction


@dataclass(frozen=True)
class Chambers:
    """The two chambers, with symbols of their areas [m^2] and dead volumes [m^3]."""

    a: Chamber
    b: Chamber
    area_a: ca.SX
    area_b: ca.SX
    dead_a: ca.SX
    dead_b: ca.SX

    @property
    def pa(self) -> ca.SX:
        """Pressure [Pa] of chamber A."""
        return self.a.pressure

    @property
    def pb(self) -> ca.SX:
        """Pressure [Pa] of chamber B."""
        return self.b.pressure

    @property
    def force(self) -> ca.SX:
        """Pressure force on the piston [N]."""
        return self.pa * self.area_a - self.pb * self.area_b


def chambers(b: Assembly, kind: JackKind, rest: float) -> Chambers:
    """Declare the chambers of a jack of this kind, at rest at about `rest` [Pa]."""
    feed = b.magnitude("Ps")
    areas_and_volumes = (b[name] for name in (*kind.areas, *kind.dead_volumes))
    return Chambers(chamber(b, "P1", feed, rest), chamber(b, "P2", feed, rest), *areas_and_volumes)


def fill(b: Assembly, jack: Chambers, flows: tuple[ca.SX, ca.SX], x: ca.SX, v: ca.SX, drain: ca.SX) -> None:
    """Fill the chambers: flows [m^3/s] into A and out of B, leakage past the piston, and the volume that it sweeps.

    x is 0 at mid stroke.
    """
    pa, pb = jack.pa, jack.pb
    across = b["Cl"] * (pa - pb)
    outside = b.slot("leakage", (ca.SX(0), ca.SX(0)), pa=pa, pb=pb, drain=drain, position=x, internal=b["Cl"])
    into_a = flows[0] - across - outside[0]
    into_b = across - flows[1] - outside[1]
    half = b["S"] / 2
    volumes = volume(jack.dead_a, jack.area_a * (half + x)), volume(jack.dead_b, jack.area_b * (half - x))
    moduli = (b.slot("modulus", b["beta"], pressure=pressure) for pressure in (pa, pb))
    hoses = b.slot("hoses", (b["ChA"], b["ChB"]), pa=pa, pb=pb) if "ChA" in b else (None, None)
    swept, inward = (jack.area_a * v, -jack.area_b * v), (into_a, into_b)
    for parts in zip((jack.a, jack.b), inward, volumes, swept, moduli, hoses, strict=True):
        continuity(b, *parts)


def rod_force(b: Assembly, jack: Chambers, x: ca.SX, v: ca.SX) -> ca.SX:
    """Force [N] that the piston gives to what it carries: pressure less friction and end stops."""
    stop = end_stop(x, v, b["S"] / 2, b["ke"], b["ce"], 1e-4)
    pressures = {"drop": jack.pa - jack.pb, "mean": (jack.pa + jack.pb) / 2, "feed": b["Ps"]}
    friction = b.slot("friction", ca.SX(0), velocity=v, position=x, **pressures, viscous=b["b"])
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
