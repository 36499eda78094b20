"""Pump drives otherwise than in the library: leaks, hoses, gas and loads that go another way, and unnamed causes."""

import casadi as ca

from workbench.plant.effects import Effect, EffectState, Scope

from .formula import off_library, shape, size, unnamed

_Pair = tuple[ca.SX, ca.SX]
_WIDTH = 5e-5  # m: over which a load stops building up
_FAST = 2e-3  # s: a play is dragged along this fast


def _widening(flow: ca.SX, s: Scope) -> ca.SX:
    """D w - C drop |drop|/p1: pressure widens the gaps."""
    drop = s["drop"]
    return flow - s.p("C") * drop * ca.sqrt(drop * drop + 1e8) / s.p("p1")


def _tightening(compliances: _Pair, s: Scope) -> _Pair:
    """C exp(-p/p1) of both hoses."""
    soft = [s.p("C") * ca.exp(-ca.fmax(s[name], 0) / s.p("p1")) for name in ("pa", "pb")]
    return compliances[0] + soft[0], compliances[1] + soft[1]


def _warming(stiffness: ca.SX, s: Scope) -> ca.SX:
    """dp/dV (1 + s (p - q)/q), q' = (p - q)/tau: gas that is warm from being pressed, until the wall cools it."""
    slow = s.x("q")
    s.rate("q", (s["pressure"] - slow) / s.p("tau"))
    return stiffness * (1 + s.p("s") * (s["pressure"] - slow) / ca.fmax(slow, 1e5))


def _softening(force: ca.SX, s: Scope) -> ca.SX:
    """F + share (full (1 - exp(-z/d)) - F), z the travel since it let go: it presses ever less hard."""
    z, v = s.x("z"), s["velocity"]
    onward = ca.fmax(v, 0) * ca.tanh((10 * s.p("d") - z) / _WIDTH)
    s.rate("z", onward + ca.fmin(v, 0) * ca.tanh(z / _WIDTH))
    return force + s.p("share") * (s["full"] * (1 - ca.exp(-ca.fmax(z, 0) / s.p("d"))) - force)


def _mixed_throttle(force: ca.SX, s: Scope) -> ca.SX:
    """F = c v where it retracts, and as much of v^2 where it extends: one check valve is missing."""
    v = s["velocity"]
    return force + s.p("c") * (ca.fmin(v, 0) + ca.fmax(v, 0) ** 2 / s.p("v1"))


def _starved(flow: ca.SX, s: Scope) -> ca.SX:
    """Q (1 - a (w/w1)^2): at speed the pump does not fill."""
    ratio = s["speed"] / s.p("w1")
    return flow * (1 - s.p("a") * ratio * ratio)


def _dragged(direction: ca.SX, s: Scope) -> ca.SX:
    """direction - clip(direction - w, -r, r), w dragged along: a plunger that hangs."""
    gap = direction - s.x("w")
    behind = ca.fmax(ca.fmin(gap, s.p("r")), -s.p("r"))
    s.rate("w", (gap - behind) / _FAST)
    return direction - behind


FORMULAS = (
    off_library(
        "pump.leakage",
        "widening gaps",
        "Ivantysyn, Ivantysynova, Hydrostatic Pumps and Motors, Akademia Books 2001, ch. 3: gaps under pressure",
        {"pump_flow": _widening},
        (size("C", "m^3/s/Pa", 3e-13, 1e-10, "leak per pressure at p1"), shape("p1", "Pa", 4e6, "pressure")),
    ),
    off_library(
        "hose.compliance",
        "exponential",
        "a braid that tightens without end",
        {"hoses": _tightening},
        (size("C", "m^3/Pa", 1.5e-12, 1e-10, "of each hose at 0"), shape("p1", "Pa", 4e6, "pressure")),
    ),
    off_library(
        "accumulator.stiffness",
        "warm gas",
        "Otis, Pourmovahed, An algorithm for computing nonflow gas processes, J. Dyn. Sys. 107, 1985",
        {"gas_stiffness": _warming},
        (size("s", "1", 3.0, 50.0, "further stiffness"), shape("tau", "s", 5.0, "time in which it cools")),
        (EffectState("q", "Pa", 1e5, 6e5),),
    ),
    off_library(
        "load.buildup",
        "softening",
        "Iwan, J. Appl. Mech. 33, 1966: a distribution of slips",
        {"loader": _softening},
        (size("share", "1", 1.0, 1.0, "of the push that builds up"), shape("d", "m", 2e-3, "travel")),
        (EffectState("z", "m", 5e-3),),
    ),
    off_library(
        "load.throttle",
        "one-sided",
        "a throttle that a check valve passes on one side",
        {"body_force": _mixed_throttle},
        (size("c", "N s/m", 2e4, 1e6, "force per speed"), shape("v1", "m/s", 0.01, "speed")),
    ),
)
CAUSES: tuple[Effect, ...] = (
    unnamed(
        "pump that does not fill",
        "flow",
        {"pump_flow": _starved},
        (size("a", "1", 0.1, 0.6, "of the flow at w1"), shape("w1", "rad/s", 100.0, "speed")),
    ),
    unnamed(
        "plunger that hangs",
        "drive",
        {"direction": _dragged},
        (size("r", "1", 0.2, 0.8, "half the play"),),
        (EffectState("w", "1", 1.0),),
    ),
)
