"""The shaft of a pump, which turns in one sense or both: its speed [rad/s] from a share of full speed or voltage."""

import casadi as ca

from ..assembly import Assembly

_SLOW = 1.0  # rad/s, within which dry torque builds up
_TURN = 2 * ca.pi


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
