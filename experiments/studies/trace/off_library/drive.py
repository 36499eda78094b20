"""Drive and sensors otherwise than in the library: timing, limits, correctors, pressure lines."""

import casadi as ca

from workbench.plant.effects import EffectState, Scope
from workbench.plant.effects.lag import FAST, first_order

from .formula import DATASHEET, off_library, shape, size

_FRANKLIN = "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998"


def _filter(command: ca.SX, s: Scope) -> ca.SX:
    """tau c' = command - c, after a delay."""
    return first_order(command, s, "c")


def _three_poles(current: ca.SX, s: Scope) -> ca.SX:
    """(tau d/dt + 1)^3 i = demand."""
    return first_order(first_order(first_order(current, s, "first"), s, "second"), s, "third")


def _bare_pole(current: ca.SX, s: Scope) -> ca.SX:
    """tau i' = demand - i, its floor of 1 us so low that nothing comes through at once."""
    length = s.p("tau") + 1e-6
    s.rate("i", (current - s.x("i")) / length)
    return s.x("i") + 1e-6 / length * (current - s.x("i"))


def _one_bends(current: ca.SX, s: Scope) -> ca.SX:
    """i = demand / (1 + w demand/limit) where demand is above 0, / (1 - v demand/limit) where below."""
    ratio = current / s["limit"]
    return current / (1 + s.p("w") * ca.fmax(ratio, 0) + s.p("v") * ca.fmax(-ratio, 0))


def _arctangent(current: ca.SX, s: Scope) -> ca.SX:
    """i = L atan(demand/L), L = limit/w."""
    reached = s["limit"] / (s.p("w") + 1e-9)
    return reached * ca.atan(current / reached)


def _one_bends_early(command: ca.SX, s: Scope) -> ca.SX:
    """u/(1 + w u) where it is above 0, u/(1 - v u) where below."""
    return command / (1 + s.p("w") * ca.fmax(command, 0) + s.p("v") * ca.fmax(-command, 0))


def _arctangent_of_command(command: ca.SX, s: Scope) -> ca.SX:
    """L atan(u/L), L = 1/w."""
    reached = 1 / (s.p("w") + 1e-9)
    return reached * ca.atan(command / reached)


def _leaky(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + c + Kp Td (e - f)/tf, c' = ki Kp e - c/leak, tf f' = e - f: an integral that forgets, and a lead."""
    rate = (s["error"] - s.x("f")) / s.p("tf")
    s.rate("c", s.p("ki") * s["gain"] * s["error"] - s.x("c") / s.p("leak"))
    s.rate("f", rate)
    return demand + s.x("c") + s["gain"] * s.p("Td") * rate


def _smooth_lead(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + Td d', tf d' = c - d, tf c' = demand - c: a lead behind a filter of two poles."""
    s.rate("c", (demand - s.x("c")) / s.p("tf"))
    rate = (s.x("c") - s.x("d")) / s.p("tf")
    s.rate("d", rate)
    return demand + s.p("Td") * rate


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


def _half_sine(position: ca.SX, s: Scope) -> ca.SX:
    """x + e S sin(pi w), w from 0 at one stop to 1 at the other."""
    stroke = s["high"] - s["low"]
    return position + s.p("e") * stroke * ca.sin(ca.pi * (position - s["low"]) / stroke)


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
_SIDES = (EffectState("a", "Pa", 1e7, follows="P1"), EffectState("b", "Pa", 1e7, follows="P2"))

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
        "three poles",
        "Strejc, Regelungstechnik 7, 1959: equal lags in series",
        {"current": _three_poles},
        (size("tau", "s", 3e-4, 7e-3, "time constant of each"),),
        tuple(EffectState(name, "A", 0.02) for name in ("first", "second", "third")),
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
        "drive.lag",
        "command three poles",
        "Strejc, Regelungstechnik 7, 1959: equal lags in series",
        {"command": _three_poles},
        (size("tau", "s", 3e-4, 7e-3, "time constant of each"),),
        tuple(EffectState(name, "1", 1.0) for name in ("first", "second", "third")),
        kinds=DATASHEET,
    ),
    off_library(
        "drive.saturation",
        "command unequal bends",
        "a power stage whose halves differ; each by Rapp, 1991, p = 1/2",
        {"command": _one_bends_early},
        (size("w", "1", 1.0, 50.0, "over the command tended to upwards"), size("v", "1", 0.4, 50.0, "and downwards")),
        kinds=DATASHEET,
    ),
    off_library(
        "drive.saturation",
        "command arctangent",
        "a smooth saturation: the inverse tangent",
        {"command": _arctangent_of_command},
        (size("w", "1", 1.0, 50.0, "over 2/pi of the command that is tended to"),),
        kinds=DATASHEET,
    ),
    off_library(
        "drive.saturation",
        "unequal bends",
        "a power stage whose halves differ; each by Rapp, 1991, p = 1/2",
        {"current": _one_bends},
        (
            size("w", "1", 5.0, 50.0, "declared limit over the one tended to upwards"),
            size("v", "1", 2.0, 50.0, "declared limit over the one tended to downwards"),
        ),
    ),
    off_library(
        "drive.saturation",
        "arctangent",
        "a smooth saturation: the inverse tangent",
        {"current": _arctangent},
        (size("w", "1", 5.0, 50.0, "declared limit over 2/pi of the one that is tended to"),),
    ),
    off_library(
        "drive.corrector",
        "leaky integral",
        "Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3",
        {"corrector": _leaky},
        (
            size("ki", "1/s", 40.0, 500.0, "integral rate"),
            size("Td", "s", 3e-4, 3e-3, "lead time"),
            shape("leak", "s", 0.05, "time in which it forgets"),
            shape("tf", "s", 5e-4, "filter of the lead"),
        ),
        (EffectState("c", "1", 1.0), EffectState("f", "1", 1.0)),
    ),
    off_library(
        "drive.corrector",
        "smooth lead",
        "Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3: derivative behind a filter of two poles",
        {"corrector": _smooth_lead},
        (size("Td", "s", 6e-4, 5e-3, "lead time"), shape("tf", "s", 5e-4, "each time constant of its filter")),
        (EffectState("c", "1", 1.0), EffectState("d", "1", 1.0)),
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
        "sensor.bend",
        "half a sine",
        "Doebelin, Measurement Systems, 5th ed. 2004, ch. 3: static calibration",
        {"sensor_position": _half_sine},
        (size("e", "1", 0.01, 0.1, "bend in the middle of the stroke"),),
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
