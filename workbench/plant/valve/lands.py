"""The lands of a spool: what they see, what they give, and what the main ones draw from the supply."""

from dataclasses import dataclass

import casadi as ca

from ...rigs.rig import Rig
from ..assembly import Assembly
from ..orifice import exponential_lap, land_flows

_RATED_DROP = 35e5  # Pa: over one land, at which servo-valves are rated


@dataclass(frozen=True)
class Lands:
    """What the lands of a spool see [Pa]: the two load ports, their supply and their drain."""

    a: ca.SX
    b: ca.SX
    supply: ca.SX
    drain: ca.SX


@dataclass(frozen=True)
class PilotFlows:
    """Flow into port A and out of port B of the pilot spool [m^3/s], lowest chamber pressure [Pa], and its signals."""

    into_a: ca.SX
    out_of_b: ca.SX
    lowest: ca.SX
    signals: dict[str, ca.SX]


@dataclass(frozen=True)
class ValveFlows:
    """Flow into chamber A and out of chamber B [m^3/s] of one valve, its lowest pressure [Pa], and its signals.

    `extends` [1]: how far direction valves are set to extend, 0 to 1; a spool has none.
    """

    into_a: ca.SX
    out_of_b: ca.SX
    lowest: ca.SX
    signals: dict[str, ca.SX]
    extends: ca.SX | None = None


def main_openings(b: Assembly, z: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Openings [m] of the main lands towards A and towards B."""
    plain = (exponential_lap(z, b["eps"]), exponential_lap(-z, b["eps"]))
    return b.slot("main_openings", plain, spool=z, lap=b["eps"], travel=b["z3max"])


def main_flows(b: Assembly, openings: tuple[ca.SX, ca.SX], lands: Lands) -> tuple[ca.SX, ca.SX]:
    """Flow into port A and out of port B [m^3/s] through the main lands of one valve."""
    flows = land_flows(openings, b["K3"], (lands.a, lands.b), lands.supply, lands.drain)
    return b.slot("main_flows", flows, opening=openings[0] - openings[1])


def rated_flow(b: Assembly | Rig) -> ca.SX:
    """Flow [m^3/s] of all valves at full travel and 35 bar a land."""
    return b["n"] * b["K3"] * b["z3max"] * _RATED_DROP**0.5
