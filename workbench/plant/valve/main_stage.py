"""Stage 3 with its electrical position loop, and the second-order spool of a valve known by its datasheet."""

from dataclasses import dataclass

import casadi as ca

from ..assembly import Assembly
from ..orifice import exponential_lap, flow_force, land_flows, root, spool_stop, volume
from .pilot import Lands, pilot_stage


@dataclass(frozen=True)
class ValveFlows:
    """Flow into chamber A and out of chamber B [m^3/s] of one valve, its lowest pressure [Pa], and its signals."""

    into_a: ca.SX
    out_of_b: ca.SX
    lowest: ca.SX
    signals: dict[str, ca.SX]


def main_openings(b: Assembly, z: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Openings [m] of the main lands towards A and towards B."""
    plain = (exponential_lap(z, b["eps"]), exponential_lap(-z, b["eps"]))
    return b.slot("main_openings", plain, spool=z, lap=b["eps"], travel=b["z3max"])


def main_flows(b: Assembly, openings: tuple[ca.SX, ca.SX], lands: Lands) -> tuple[ca.SX, ca.SX]:
    """Flow into port A and out of port B [m^3/s] through the main lands of one valve."""
    return b.slot("main_flows", land_flows(openings, b["K3"], (lands.a, lands.b), lands.supply, lands.drain))


def three_stage(
    b: Assembly, command: ca.SX, lands: Lands, pilot_supply: ca.SX, drain: ca.SX, corrector: str
) -> ValveFlows:
    """Three-stage valve: `command` [1] -> main-spool flows. The pilot is fed from `pilot_supply` [Pa]."""
    feed = b.magnitude("Ps")
    pg = b.state("Pg3", "Pa", feed, 0.5 * feed)
    pd = b.state("Pd3", "Pa", feed, 0.5 * feed)
    z = b.state("z3", "m", b.magnitude("z3max"))
    v = b.state("v3", "m/s", 0.5)
    current = _drive(b, command, z, corrector)
    pilot = pilot_stage(b, current, Lands(pg, pd, pilot_supply, drain), pilot_supply, drain)
    leak = b["Kf3"]
    swept = b["S3"] * z
    b.rate("Pg3", b["beta"] * (pilot.into_a + leak * root(pilot_supply - pg) - b["S3"] * v) / volume(b["Vo3"], swept))
    b.rate(
        "Pd3", b["beta"] * (leak * root(pilot_supply - pd) - pilot.out_of_b + b["S3"] * v) / volume(b["Vo3"], -swept)
    )
    openings = main_openings(b, z)
    ports = (lands.a, lands.b)
    friction = b.slot("main_friction", b["Fs3"] * ca.tanh(v / 5e-3), spool=z, velocity=v)
    force = b["S3"] * (pg - pd) - b["psi3"] * v - friction
    force -= flow_force(openings, b["rff3"] * b["K3"], ports, lands.supply, lands.drain)
    force -= spool_stop(z, v, b["z3over"] * b["z3max"], b["k3stop"], b["M3"])
    b.rate("z3", v)
    b.rate("v3", force / b["M3"])
    b.dry_friction("Fs3")
    lowest = ca.fmin(pilot.lowest, ca.fmin(pg, pd))
    return ValveFlows(*main_flows(b, openings, lands), lowest, {"current": current, "spool": z, **pilot.signals})


def second_order(b: Assembly, command: ca.SX, lands: Lands) -> ValveFlows:
    """Second-order spool with lap: z'' = w0^2 (zmax (u + z0) - z) - 2 zeta w0 z', then the same lands."""
    travel = b.magnitude("z3max")
    z = b.state("z3", "m", travel)
    v = b.state("v3", "m/s", 6 * b.magnitude("f0") * travel)
    w0 = 2 * ca.pi * b["f0"]
    demand = b["z3max"] * (b.slot("command", command) + b["z0"])
    b.rate("z3", v)
    b.rate("v3", w0 * w0 * (demand - z) - 2 * b["zeta"] * w0 * v)
    return ValveFlows(*main_flows(b, main_openings(b, z), lands), lands.supply, {"spool": z})


def _drive(b: Assembly, command: ca.SX, z: ca.SX, corrector: str) -> ca.SX:
    """Spool loop and current amplifier: normalised error -> pilot current [A]."""
    error = b.slot("command", command) - z / b["z3max"]
    demand = b["Kp"] * error
    if "lead" in corrector:
        filtered = b.state("c1", "1", 1.0)
        b.rate("c1", (error - filtered) / b["tf"])
        demand += b["Kp"] * b["Td"] * (error - filtered) / b["tf"]
    if "pi" in corrector:
        integral = b.state("c0", "1", 1.0)
        demand += integral
        excess = _saturate(demand, b["isat"]) - demand
        b.rate("c0", b["Kp"] * error / b["Ti"] + 400 * excess)
    demand = b.slot("corrector", demand, error=error, gain=b["Kp"], limit=b["isat"])
    return b.slot("current", b["imax"] * _saturate(demand, b["isat"]), limit=b["imax"] * b["isat"])


def _saturate(value: ca.SX, limit: ca.SX) -> ca.SX:
    return ca.fmax(ca.fmin(value, limit), -limit)
