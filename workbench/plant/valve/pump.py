"""Pump drives in place of a servo-valve and its supply: shaft, pump, direction valves and low side, in one direction or
both.
"""

from dataclasses import dataclass

import casadi as ca

from ...rigs.rig import Rig
from ..assembly import Assembly
from ..oil import chamber, continuity
from ..orifice import root
from .kind import ProbePoint, Valve
from .lands import Lands, ValveFlows

_NULL = 2e-3  # command below which no valve is switched on by its sign
_SLOW = 1.0  # rad/s, within which dry torque builds up
_TURN = 2 * ca.pi
_PART = 0.05  # of a direction: where a mean over a switch is below, so is the share of the speed
_STEEP = 3.0  # of a shuttle valve: it opens between a half and three halves of the pressure that half opens it


def accumulator(b: Assembly, low: ca.SX) -> ca.SX:
    """Flow [m^3/s] out of the accumulator to the low side at pressure `low` [Pa]; gas polytropic, p V^kg constant."""
    gas = b.state("Pg", "Pa", b.magnitude("Pr"), number="Pr")
    line = (gas - low) / b["Rl"]
    check = b["Kc"] * ca.fmax(low - gas - b["pk"], 0)
    flow = b.slot("accumulator", line - check, drop=gas - low, pressure=gas)
    volume = b["Vg"] * (b["pg"] / gas) ** (1 / b["kg"])
    stiffness = b.slot("gas_stiffness", b["kg"] * gas / volume, pressure=gas)
    b.rate("Pg", -stiffness * flow)
    return flow


@dataclass(frozen=True)
class SelectedFlows:
    """Flows [m^3/s]: into A, out of B, taken from the delivery, given back to the low side."""

    into_a: ca.SX
    out_of_b: ca.SX
    taken: ca.SX
    returned: ca.SX


def asked_direction(command: ca.SX, direction: ca.SX) -> ca.SX:
    """Direction, -1 to 1, that the solenoids are asked for: `direction`, or where it is 0 the command's sign."""
    return direction + ca.tanh(command / _NULL) * (1 - ca.fmin(ca.fabs(direction), 1))


def openings(b: Assembly, asked: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Openings, 0 to 1, of the valves that feed A and B, which follow the asked direction in a first-order lag."""
    asked = b.slot("direction", asked)
    opened = []
    for name, sign in (("oa", 1), ("ob", -1)):
        opening = b.state(name, "1", 1.0)
        b.rate(name, (ca.fmin(ca.fmax(sign * asked, 0), 1) - opening) / b["td"])
        opened.append(opening)
    return opened[0], opened[1]


def selected_flows(
    b: Assembly, opened: tuple[ca.SX, ca.SX], delivery: ca.SX, chambers: tuple[ca.SX, ca.SX], low: ca.SX
) -> SelectedFlows:
    """Flows of the valves between the pressures [Pa] of delivery, chambers A and B, and low side."""
    feed = [opening * b["Kd"] * _fed(b, delivery - chamber) for opening, chamber in zip(opened, chambers, strict=True)]
    drain = [opening * b["Kd"] * root(chamber - low) for opening, chamber in zip(opened[::-1], chambers, strict=True)]
    return SelectedFlows(feed[0] - drain[0], drain[1] - feed[1], feed[0] + feed[1], drain[0] + drain[1])


def _fed(b: Assembly, drop: ca.SX) -> ca.SX:
    """Root [Pa^0.5] of what is left of a pressure drop [Pa] for the direction valve."""
    return root(b.slot("delivery_drop", drop))


def shaft_speed(b: Assembly, share: ca.SX, drop: ca.SX, least: float = 0.0) -> tuple[ca.SX, dict[str, ca.SX]]:
    """Speed at a share, `least` to 1, against the pressure `drop` [Pa] across the pump; signals of a motor, if any.

    `least` is 0 of a pump that turns in one sense only, -1 of one that turns both ways.
    """
    if "Rm" not in b:
        return b["nmax"] * share, {}
    w = b.state("w", "rad/s", b.magnitude("nmax"))
    volts = b["Um"] * (_speed_loop(b, b["nmax"] * share, w, least) if "Kn" in b else share)
    current = b.state("im", "A", b.magnitude("Um") / b.magnitude("Rm"))
    b.rate("im", (volts - b["Rm"] * current - b["km"] * w) / b["Lm"])
    lost = (b["T0"] + b["Tp"] * ca.fabs(drop)) * ca.tanh(w / _SLOW)
    lost = b.slot("motor_losses", lost, speed=w, drop=drop)
    if least == 0:
        lost += 10 * b["km"] * b["km"] / b["Rm"] * ca.fmin(w, 0)  # it turns in one sense only
    b.rate("w", (b["km"] * current - lost - b["D"] * drop) / b["Jm"])
    return w, {"current": current}


def _speed_loop(b: Assembly, wanted: ca.SX, w: ca.SX, least: float) -> ca.SX:
    """PI speed loop with its output, share of full voltage, in `least` to 1; the integral stops there."""
    integral = b.state("cn", "1", 1.0)
    demand = b["Kn"] * (wanted - w) + integral
    share = ca.fmax(ca.fmin(demand, 1), least)
    b.rate("cn", b["Kn"] * (wanted - w) / b["Tn"] + (share - demand) / b["Tn"])
    return share


class Pump(Valve):
    """Command [1], the signed share of full speed or voltage -> shaft -> pump -> direction valves -> chambers."""

    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """Delivery and suction are volumes of their own; `supply` is where the relief valve opens.

        Gas comes out on the suction alone: the delivery's pressure is above that of the chambers that it feeds.
        """
        direction = b.input("direction", "1", 1.0)
        rest = b.magnitude("Pr")
        delivery, suction = b.state("Pd", "Pa", b.magnitude("Ps"), rest), chamber(b, "P0", rest, rest)
        low = suction.pressure
        command = b.slot("command", command)
        asked = asked_direction(command, direction)
        speed, signals = shaft_speed(b, ca.fmax(command * ca.tanh(asked / _PART), 0), delivery - low)
        given = b["D"] * speed - b["Cp"] * (delivery - low)
        given = b.slot("pump_flow", given, speed=speed, drop=delivery - low)
        relief = b["Kr"] * ca.fmax(delivery - supply, 0)
        opened = openings(b, asked)
        valves = selected_flows(b, opened, delivery, (lands.a, lands.b), low)
        stored = accumulator(b, low)
        b.rate("Pd", b["beta"] * (given - relief - valves.taken) / b["Vp"])
        continuity(b, suction, valves.returned + stored + relief - given, b["Vs"])
        lowest = ca.fmin(low, delivery)
        signals["pump_speed"] = speed * asked
        return ValveFlows(valves.into_a, valves.out_of_b, lowest, signals, opened[0])

    def rated_flow(self, b: Assembly | Rig) -> ca.SX:
        """Flow [m^3/s] of all pumps at full speed."""
        return ca.SX(b["n"] * b["D"] * b["nmax"])

    def rest_pressure(self, rig: Rig) -> float:
        """That of the low side."""
        return rig["Pr"]

    def usual_flow(self, rig: Rig) -> float:
        """Flow [m^3/s] of all pumps at full speed."""
        return rig["n"] * rig["D"] * rig["nmax"]

    def probe_points(self, rig: Rig) -> tuple[ProbePoint, ...]:
        """The command."""
        return (ProbePoint("drive", "command", "command", "1", 0.05),)


class TwoWayPump(Pump):
    """Command [1], the signed share of full speed or voltage -> shaft -> pump between the chambers."""

    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """The low side is a volume of its own; `supply` is where a chamber's relief valve opens."""
        rest = b.magnitude("Pr")
        suction = chamber(b, "P0", rest, rest)
        low = suction.pressure
        drop = lands.a - lands.b
        speed, signals = shaft_speed(b, b.slot("command", command), drop, least=-1.0)
        given = b.slot("pump_flow", b["D"] * speed - b["Cp"] * drop, speed=speed, drop=drop)
        lost_a, lost_b = (
            _to_low_side(b, chamber, other, low, supply) for chamber, other in ((lands.a, lands.b), (lands.b, lands.a))
        )
        continuity(b, suction, lost_a + lost_b + accumulator(b, low), b["Vs"])
        signals["pump_speed"] = speed
        return ValveFlows(given - lost_a, given + lost_b, ca.fmin(low, ca.fmin(lands.a, lands.b)), signals)


def _to_low_side(b: Assembly, chamber: ca.SX, other: ca.SX, low: ca.SX, supply: ca.SX) -> ca.SX:
    """Flow [m^3/s] from a chamber to the low side: through the shuttle valve, shut in its middle, which joins
    the chamber of less pressure to it, and the relief valve, less what the anti-cavitation valve lets in."""
    joined = (1 + ca.tanh(_STEEP * ((other - chamber) / b["pd"] - 1))) / 2
    relief = b["Kr"] * ca.fmax(chamber - supply, 0)
    let_in = b["Kv"] * ca.fmax(low - chamber - b["pv"], 0)
    return joined * b["Kd"] * root(chamber - low) + relief - let_in
