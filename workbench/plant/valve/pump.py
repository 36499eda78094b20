"""Pump drive: shaft, pump, direction valves and low side in place of a servo-valve and its supply."""

import casadi as ca

from ...rigs.rig import Rig
from ..assembly import Assembly
from ..pump.low_side import accumulator
from ..pump.selector import asked_direction, openings, selected_flows
from ..pump.shaft import shaft_speed
from .kind import ProbePoint, Valve
from .lands import Lands, ValveFlows

_PART = 0.05  # of a direction: where a mean over a switch is below, so is the share of the speed


class Pump(Valve):
    """Command [1], the signed share of full speed or voltage -> shaft -> pump -> direction valves -> chambers."""

    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """Delivery and suction are volumes of their own; `supply` is where the relief valve opens."""
        direction = b.input("direction", "1", 1.0)
        rest = b.magnitude("Pr")
        delivery, low = b.state("Pd", "Pa", b.magnitude("Ps"), rest), b.state("P0", "Pa", rest, rest)
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
        b.rate("P0", b["beta"] * (valves.returned + stored + relief - given) / b["Vs"])
        lowest = ca.fmin(low, delivery)
        signals["pump_speed"] = speed * asked
        return ValveFlows(valves.into_a, valves.out_of_b, lowest, signals, opened[0])

    def rated_flow(self, b: Assembly) -> ca.SX:
        """Flow [m^3/s] of all pumps at full speed."""
        return b["n"] * b["D"] * b["nmax"]

    def rest_pressure(self, rig: Rig) -> float:
        """That of the low side."""
        return rig["Pr"]

    def usual_flow(self, rig: Rig) -> float:
        """Flow [m^3/s] of all pumps at full speed."""
        return rig["n"] * rig["D"] * rig["nmax"]

    def probe_points(self, rig: Rig) -> tuple[ProbePoint, ...]:
        """The command."""
        return (ProbePoint("drive", "command", "command", "1", 0.05),)
