"""Two-way pump: the pump turns both ways and feeds one chamber from the other; valves even out what the rod takes."""

import casadi as ca

from ..assembly import Assembly
from ..orifice import root
from ..pump.low_side import accumulator
from ..pump.shaft import shaft_speed
from .lands import Lands, ValveFlows
from .pump import Pump

_STEEP = 3.0  # of a shuttle valve: it opens between a half and three halves of the pressure that half opens it


class TwoWayPump(Pump):
    """Command [1], the signed share of full speed or voltage -> shaft -> pump between the chambers."""

    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """The low side is a volume of its own; `supply` is where a chamber's relief valve opens."""
        rest = b.magnitude("Pr")
        low = b.state("P0", "Pa", rest, rest)
        drop = lands.a - lands.b
        speed, signals = shaft_speed(b, b.slot("command", command), drop, least=-1.0)
        given = b.slot("pump_flow", b["D"] * speed - b["Cp"] * drop, speed=speed, drop=drop)
        lost_a, lost_b = (
            _to_low_side(b, chamber, other, low, supply) for chamber, other in ((lands.a, lands.b), (lands.b, lands.a))
        )
        b.rate("P0", b["beta"] * (lost_a + lost_b + accumulator(b, low)) / b["Vs"])
        signals["pump_speed"] = speed
        return ValveFlows(given - lost_a, given + lost_b, ca.fmin(low, ca.fmin(lands.a, lands.b)), signals)


def _to_low_side(b: Assembly, chamber: ca.SX, other: ca.SX, low: ca.SX, supply: ca.SX) -> ca.SX:
    """Flow [m^3/s] from a chamber to the low side: through the shuttle valve, shut in its middle, which joins
    the chamber of less pressure to it, and the relief valve, less what the anti-cavitation valve lets in."""
    joined = (1 + ca.tanh(_STEEP * ((other - chamber) / b["pd"] - 1))) / 2
    relief = b["Kr"] * ca.fmax(chamber - supply, 0)
    let_in = b["Kv"] * ca.fmax(low - chamber - b["pv"], 0)
    return joined * b["Kd"] * root(chamber - low) + relief - let_in
