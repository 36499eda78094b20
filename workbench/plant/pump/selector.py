"""On/off direction valves: the chamber that the pump feeds; the other chamber drains to the low side."""

from dataclasses import dataclass

import casadi as ca

from ..assembly import Assembly
from ..orifice import root

_NULL = 2e-3  # command below which no valve is switched on by its sign


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
