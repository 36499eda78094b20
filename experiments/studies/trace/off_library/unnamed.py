"""Causes that no effect of the library names. What is right to say of them is the equation in which they sit."""

import casadi as ca

from workbench.plant.effects import EffectNumber, EffectState, Scope

from .formula import oscillator, shape, size, unnamed

_Pair = tuple[ca.SX, ca.SX]


def _lifted_seal(leaks: _Pair, s: Scope) -> _Pair:
    """C dp^3/p1^2 from A to B: the gap past the piston grows with the pressure across it."""
    drop = s["pa"] - s["pb"]
    flow = s.p("C") * drop * drop * drop / s.p("p1") ** 2
    return leaks[0] + flow, leaks[1] - flow


def _ripple(supply: ca.SX, s: Scope) -> ca.SX:
    """P + A sin(2 pi f t): the pump's pistons."""
    return supply + s.p("A") * oscillator(s, ("sine", "cosine"), s.p("f"))


def _drag(force: ca.SX, s: Scope) -> ca.SX:
    """c v |v|."""
    return force + s.p("c") * s["velocity"] * ca.sqrt(s["velocity"] * s["velocity"] + 1e-6)


def _bump(force: ca.SX, s: Scope) -> ca.SX:
    """F q exp((1 - q^2)/2), q = (x - x0)/w: uphill, then downhill."""
    q = (s["position"] - s.p("x0")) / s.p("w")
    return force + s.p("F") * q * ca.exp((1 - q * q) / 2)


def _cogs(force: ca.SX, s: Scope) -> ca.SX:
    """F sin(2 pi x/pitch): a rack that the load drives."""
    return force + s.p("F") * ca.sin(2 * ca.pi * s["position"] / s.p("pitch"))


def _imbalance(force: ca.SX, s: Scope) -> ca.SX:
    """F sin(2 pi f t): a motor on the moving mass, out of balance."""
    return force + s.p("F") * oscillator(s, ("sine", "cosine"), s.p("f"))


def _magnetic(current: ca.SX, s: Scope) -> ca.SX:
    """i/(1 + (w i/20 mA)^2)^(1/2) makes torque: the iron saturates, the measured current does not."""
    ratio = s.p("w") * current / 0.02
    return current / ca.sqrt(1 + ratio * ratio)


def _null_shift(current: ca.SX, s: Scope) -> ca.SX:
    """i + i0 makes torque: the motor has come out of adjustment."""
    return current + s.p("i0")


def _dashpot(friction: ca.SX, s: Scope) -> ca.SX:
    """c v (z/z1)^2: damping grooves at the ends of the main spool's travel."""
    ratio = s["spool"] / s.p("z1")
    return friction + s.p("c") * s["velocity"] * ratio * ratio


def _detent(friction: ca.SX, s: Scope) -> ca.SX:
    """F tanh(z/z1): something holds the main spool at null."""
    return friction + s.p("F") * ca.tanh(s["spool"] / s.p("z1"))


def _drooping_gain(demand: ca.SX, s: Scope) -> ca.SX:
    """Kp e/(1 + w |e|): the drive gives way to large errors."""
    return demand / (1 + s.p("w") * ca.sqrt(s["error"] * s["error"] + 1e-8))


def _notch(demand: ca.SX, s: Scope) -> ca.SX:
    """demand - d times its part within a band about f: somebody put a notch into the drive."""
    w0 = 2 * ca.pi * s.p("f")
    s.rate("slow", w0 * s.x("band"))
    s.rate("band", w0 * (demand - s.x("slow") - s.x("band")))
    return demand - s.p("d") * s.x("band")


def _transducer(pressure: ca.SX, s: Scope) -> ca.SX:
    """pA + a (pA - p0)^2/p0, p0 = 100 bar: a transducer that bends."""
    away = pressure - 1e7
    return pressure + s.p("a") * away * away / 1e7


_TURN = (EffectState("sine", "1", 1.0), EffectState("cosine", "1", 1.0))
_SIDE = (EffectState("slow", "1", 1.0), EffectState("band", "1", 1.0))

EFFECTS = (
    unnamed(
        "piston seal that opens",
        "flow",
        {"leakage": _lifted_seal},
        (size("C", "m^3/s/Pa", 1e-11, 1e-8, "leak at p1"), shape("p1", "Pa", 5e6, "pressure")),
    ),
    unnamed(
        "pump ripple",
        "flow",
        {"supply": _ripple},
        (size("A", "Pa", 2e5, 5e6, "amplitude"), shape("f", "Hz", 38.0, "frequency")),
        _TURN,
        ("three-stage", "second-order"),
    ),
    unnamed("air drag", "force", {"load": _drag}, (size("c", "N s^2/m^2", 500.0, 1e5, "drag"),)),
    unnamed(
        "bump in the track",
        "force",
        {"load": _bump},
        (
            size("F", "N", 1000.0, 5e4, "steepest force"),
            EffectNumber("x0", "m", "mm", 0.015, -0.1, 0.1, "its place"),
            shape("w", "m", 0.015, "half its width"),
        ),
    ),
    unnamed(
        "cogged rack",
        "force",
        {"load": _cogs},
        (size("F", "N", 500.0, 5e4, "amplitude"), shape("pitch", "m", 0.02, "pitch")),
    ),
    unnamed(
        "motor out of balance",
        "force",
        {"load": _imbalance},
        (size("F", "N", 300.0, 5e4, "amplitude"), shape("f", "Hz", 17.0, "frequency")),
        _TURN,
    ),
    unnamed(
        "iron of the torque motor saturates",
        "pilot",
        {"motor_current": _magnetic},
        (size("w", "1", 4.0, 50.0, "rated current over the one that saturates"),),
    ),
    unnamed("null shift", "pilot", {"motor_current": _null_shift}, (size("i0", "A", 2e-4, 5e-3, "current"),)),
    unnamed(
        "dashpot of the main spool",
        "main",
        {"main_friction": _dashpot},
        (size("c", "N s/m", 500.0, 1e6, "damping at z1"), shape("z1", "m", 3e-4, "travel")),
    ),
    unnamed(
        "detent of the main spool",
        "main",
        {"main_friction": _detent},
        (size("F", "N", 50.0, 5e3, "force"), shape("z1", "m", 5e-5, "travel")),
    ),
    unnamed("gain that gives way", "drive", {"corrector": _drooping_gain}, (size("w", "1", 2.0, 100.0, "how soon"),)),
    unnamed(
        "notch in the drive",
        "drive",
        {"corrector": _notch},
        (size("d", "1", 0.4, 0.95, "depth"), shape("f", "Hz", 90.0, "frequency")),
        _SIDE,
    ),
    unnamed("transducer that bends", "sensor", {"sensor_pa": _transducer}, (size("a", "1", 0.05, 0.5, "bend"),)),
)
