"""Second-order valve: the spool with its drive as one oscillator, for a valve that is known by its datasheet."""

import casadi as ca

from ...rigs.rig import Rig
from ..assembly import Assembly
from .kind import ProbePoint, Valve
from .lands import Lands, ValveFlows, main_flows, main_openings


class SecondOrder(Valve):
    """Command [1] -> spool -> main flows; it has no pilot, so that supply and drain of one are not used."""

    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """z'' = w0^2 (zmax (u + z0) - z) - 2 zeta w0 z', then the lands of a main spool."""
        travel = b.magnitude("z3max")
        z = b.state("z3", "m", travel)
        v = b.state("v3", "m/s", 6 * b.magnitude("f0") * travel)
        w0 = 2 * ca.pi * b["f0"]
        demand = b["z3max"] * (b.slot("command", command) + b["z0"])
        b.rate("z3", v)
        b.rate("v3", w0 * w0 * (demand - z) - 2 * b["zeta"] * w0 * v)
        return ValveFlows(*main_flows(b, main_openings(b, z), lands), lands.supply, {"spool": z})

    def probe_points(self, rig: Rig) -> tuple[ProbePoint, ...]:
        """The command."""
        return (ProbePoint("drive", "command", "command", "1", 0.05),)
