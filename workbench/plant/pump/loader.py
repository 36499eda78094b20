"""A second cylinder whose oil leaves through a pressure valve: it pushes back while the jack is set to extend."""

import casadi as ca

from ..assembly import Assembly
from ..valve.lands import ValveFlows

_SLOW = 1e-3  # m/s, within which the push builds up behind a valve that tells no direction


def loader_force(b: Assembly, valve: ValveFlows, x: ca.SX, v: ca.SX) -> ca.SX:
    """Force [N] against extension: set pressure [Pa], an input, on the area AL; none while the jack retracts."""
    full = b["AL"] * b.input("load_setting", "Pa", 1e7)
    extends = (1 + ca.tanh(v / _SLOW)) / 2 if valve.extends is None else valve.extends
    return b.slot("loader", full * extends, full=full, position=x, velocity=v)
