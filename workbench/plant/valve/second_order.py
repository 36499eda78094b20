"""Second-order valve: the spool with its drive as one oscillator, for a valve that is known by its datasheet."""

import casadi as ca

from ...rigs.rig import Rig
from ..assembly import Assembly
from .kind import ProbePoint, Valve
from .lands import Lands, ValveFlows, main_flows, main_openings

_LARGEST = 2.0  # of a spool loop's output: the error of a step from full travel to full travel


class SecondOrder(Valve):
    """Command [1] -> spool -> main flows; it has no pilot, so that supply and drain of one are not used."""

    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """z'' = 2 zeta w0 (vd - z'), vd = w0 zmax e/(2 zeta), e = u + z0 - z/zmax, then the lands of a main spool.

        That is z'' = w0^2 (zmax (u + z0) - z) - 2 zeta w0 z', written so that effects find the error e of the spool's
        loop and the speed vd that the drive asks for; a dry friction Fc [1] of an effect adds -w0^2 zmax Fc.
        """
        travel = b.magnitude("z3max")
        z = b.state("z3", "m", travel)
        v = b.state("v3", "m/s", 6 * b.magnitude("f0") * travel)
        w0 = 2 * ca.pi * b["f0"]
        spool = z / b["z3max"]
        error = b.slot("magnet", b.slot("command", command)) + b["z0"] - spool
        drive = b.slot("corrector", error, error=error, spool=spool, gain=ca.SX(1), limit=ca.SX(_LARGEST))
        asked = b.slot("spool_speed", w0 * b["z3max"] * drive / (2 * b["zeta"]), travel=b["z3max"], velocity=v)
        friction = b.slot("spool_friction", ca.SX(0), velocity=v)
        b.rate("z3", v)
        b.rate("v3", 2 * b["zeta"] * w0 * (asked - v) - w0 * w0 * b["z3max"] * friction)
        return ValveFlows(*main_flows(b, main_openings(b, z), lands), lands.supply, {"spool": z})

    def probe_points(self, rig: Rig) -> tuple[ProbePoint, ...]:
        """The command."""
        return (ProbePoint("drive", "command", "command", "1", 0.05),)
