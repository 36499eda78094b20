"""Drive and sensors otherwise than in the library: timing, limits, correctors, pressure lines."""

import casadi as ca

from ....plant.effects import EffectNumber, EffectState, Scope
from ....plant.effects.lag import FAST, first_order, second_order
from .formula import off_library, shape, size

_FRANKLIN = "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998"


def _filter(command: ca.SX, s: Scope) -> ca.SX:
    """tau c' = command - c, after a delay."""
    return first_order(command, s, "c")


def _two_poles(value: ca.SX, s: Scope) -> ca.SX:
    """tau^2 y'' + 2 zeta tau y' + y = value."""
    return second_order(value, s, "y")


def _bare_pole(current: ca.SX, s: Scope) -> ca.SX:
    """tau i' = demand - i, its floor of 1 us so low that nothing comes through at once."""
    length = s.p("tau") + 1e-6
    s.rate("i", (current - s.x("i")) / length)
    return s.x("i") + 1e-6 / length * (current - s.x("i"))


def _one_sided(current: ca.SX, s: Scope) -> ca.SX:
    """-limit (1 - down) <= i <= limit (1 - up)."""
    return ca.fmax(ca.fmin(current, (1 - s.p("up")) * s["limit"]), -(1 - s.p("down")) * s["limit"])


def _fourth_power(current: ca.SX, s: Scope) -> ca.SX:
    """i = demand / (1 + (w demand / declared limit)^4)^(1/4)."""
    ratio = s.p("w") * current / s["limit"]
    return current / (1 + ratio**4) ** 0.25


def _leaky(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + c, c' = ki Kp e - c/leak: an integral that forgets."""
    s.rate("c", s.p("ki") * s["gain"] * s["error"] - s.x("c") / s.p("leak"))
    return demand + s.x("c")


def _lag_lead(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + k (demand - c), tf c' = demand - c: k above 0 leads."""
    gap = demand - s.x("c")
    s.rate("c", gap / s.p("tf"))
    return demand + s.p("k") * gap


def _slow_a(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau_a y' = pA - y, exact at tau_a = 0."""
    return _slow(pressure, s, "a")


def _slow_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau_b y' = pB - y, exact at tau_b = 0."""
    return _slow(pressure, s, "b")


def _slow(pressure: ca.SX, s: Scope, side: str) -> ca.SX:
    length = s.p(f"tau_{side}") + FAST
    s.rate(side, (pressure - s.x(side)) / length)
    return s.x(side) + FAST / length * (pressure - s.x(side))


def _late_a(pressure: ca.SX, s: Scope) -> ca.SX:
    """Half a first-order all-pass: see _late."""
    return _late(pressure, s, "a")


def _late_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """See _late."""
    return _late(pressure, s, "b")


def _late(pressure: ca.SX, s: Scope, side: str) -> ca.SX:
    """y = 2 w - p, (tau/2 + T0) w' = p - w, T0 = 10 us: an all-pass that is late by tau, mixed out as tau goes to 0."""
    length = s.p("tau") / 2 + FAST
    s.rate(side, (pressure - s.x(side)) / length)
    return pressure + 2 * s.p("tau") / (s.p("tau") + 2 * FAST) * (s.x(side) - pressure)


_DELAY = size("delay", "s", 1.5e-3, 2e-2, "time by which the command is late")
_TAU = size("tau", "s", 1e-3, 2e-2, "time constant")
_Y = (EffectState("y", "A", 0.02), EffectState("y_rate", "A", 0.02))
_SIDES = (EffectState("a", "Pa", 1e7, 1e7), EffectState("b", "Pa", 1e7, 1e7))

EFFECTS = (
    off_library(
        "drive.delay",
        "shift and filter",
        f"{_FRANKLIN}, ch. 4 and 5",
        {"command": _filter},
        (_DELAY, size("tau", "s", 2e-4, 2e-3, "time constant of the filter")),
        (EffectState("c", "1", 1.0),),
        "delay",
    ),
    off_library(
        "drive.lag",
        "two poles",
        "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6: coil and amplifier with current feedback",
        {"current": _two_poles},
        (
            size("tau", "s", 5e-4, 1e-2, "1/(2 pi) of the period"),
            EffectNumber("zeta", "1", "1", 0.8, 0.5, 1.5, "damping"),
        ),
        _Y,
    ),
    off_library(
        "drive.lag",
        "bare pole",
        "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6: torque motor driven through its coil",
        {"current": _bare_pole},
        (_TAU,),
        (EffectState("i", "A", 0.02),),
    ),
    off_library(
        "drive.saturation",
        "one-sided",
        "a power stage whose halves differ",
        {"current": _one_sided},
        (size("up", "1", 0.9, 0.98, "lost of the limit upwards"), size("down", "1", 0.75, 0.98, "lost downwards")),
    ),
    off_library(
        "drive.saturation",
        "fourth power",
        "Rapp, 2nd European Conference on Satellite Communications, 1991: p = 2",
        {"current": _fourth_power},
        (size("w", "1", 5.0, 50.0, "declared limit over the one that is tended to"),),
    ),
    off_library(
        "drive.corrector",
        "leaky integral",
        "Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3",
        {"corrector": _leaky},
        (size("ki", "1/s", 40.0, 500.0, "integral rate"), shape("leak", "s", 0.05, "time in which it forgets")),
        (EffectState("c", "1", 1.0),),
    ),
    off_library(
        "drive.corrector",
        "lag-lead",
        "Franklin, Powell, Emami-Naeini, Feedback Control of Dynamic Systems, ch. 6",
        {"corrector": _lag_lead},
        (size("k", "1", 0.5, 5.0, "high-frequency gain less 1"), shape("tf", "s", 2e-3, "its time constant")),
        (EffectState("c", "1", 1.0),),
    ),
    off_library(
        "sensor.lag",
        "unequal lines",
        "Doebelin, Measurement Systems, 5th ed. 2004, sec. 6.6",
        {"sensor_pa": _slow_a, "sensor_pb": _slow_b},
        (size("tau_a", "s", 2e-3, 0.1, "time constant of A"), size("tau_b", "s", 1e-3, 0.1, "time constant of B")),
        _SIDES,
    ),
    off_library(
        "sensor.lag",
        "all-pass",
        "first-order Pade approximation of a line's travel time",
        {"sensor_pa": _late_a, "sensor_pb": _late_b},
        (size("tau", "s", 2e-3, 0.05, "time by which the signal is late"),),
        _SIDES,
    ),
)
