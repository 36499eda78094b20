"""Valve otherwise than in the library: hysteresis, spool friction, laps and unequal gains."""

import casadi as ca

from workbench.plant.effects import EffectState, Scope
from workbench.plant.orifice import exponential_lap

from .formula import off_library, shape, size, smooth_sign

_Pair = tuple[ca.SX, ca.SX]
_FAST = 8e-5  # s: a hysteresis is dragged along this fast


def _generalised_play(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - clip(i - w, -down, up), T0 w' = what the clip takes off: unequal edges."""
    gap = current - s.x("w")
    behind = ca.fmax(ca.fmin(gap, s.p("up")), -s.p("down"))
    s.rate("w", (gap - behind) / _FAST)
    return current - behind


def _dahl_loop(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - r z, z' = d (1 - z sgn d)^2/width, d = (i - w)/T0 = w': it turns slowly into its branches."""
    rate = (current - s.x("w")) / _FAST
    along = 1 - s.x("z") * smooth_sign(rate, 1e-3)
    s.rate("w", rate)
    s.rate("z", rate * ca.fabs(along) * along / s.p("width"))
    return current - s.p("r") * s.x("z")


def _line(friction: ca.SX, s: Scope) -> ca.SX:
    """F = Fc sat(v/v0): a stiff viscous band about standstill, then constant (Karnopp, made continuous)."""
    return friction + s.p("Fc") * ca.fmax(ca.fmin(s["velocity"] / s.p("v0"), 1), -1)


def _dahl(friction: ca.SX, s: Scope) -> ca.SX:
    """F = Fc z, z' = v (1 - z sgn v)/d."""
    speed = s["velocity"]
    s.rate("z", (speed - s.x("z") * ca.fabs(speed)) / s.p("d"))
    return friction + s.p("Fc") * s.x("z")


def _bare_lap(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(z - d), d = overlap * travel: the lap as declared, further out, and so less leak at null."""
    overlap = s.p("overlap") * s["travel"]
    return exponential_lap(s["spool"] - overlap, s["lap"]), exponential_lap(-s["spool"] - overlap, s["lap"])


def _cubic(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(z^3/(z^2 + d^2)): lands that open with the cube of a small travel."""
    z, d = s["spool"], s.p("overlap") * s["travel"]
    return _both(z - z * d * d / (z * z + d * d + 1e-18), s)


def _round_ports(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(g(z)), g = z |z|/(2 d) up to |z| = d, then |z| - d/2: ports that open with the square."""
    z, d = s["spool"], s.p("overlap") * s["travel"]
    inside = ca.fmin(ca.fabs(z), d)
    return _both(z - ca.sign(z) * (inside - inside * inside / (2 * d + 1e-12)), s)


def _both(z: ca.SX, s: Scope) -> _Pair:
    return exponential_lap(z, s["lap"]), exponential_lap(-z, s["lap"])


def _bent(openings: _Pair, s: Scope) -> _Pair:
    """o (1 + a o/travel) for the lands that extend, o (1 - a o/travel) for those that retract."""
    forward, backward = openings
    bend = s.p("a") / s["travel"]
    return forward * (1 + bend * forward), backward * (1 - bend * backward)


def _one_edge(flows: _Pair, s: Scope) -> _Pair:
    """QA (1 + a) where oil flows into A, as declared where it flows out."""
    into_a, out_of_b = flows
    return into_a + s.p("a") * ca.fmax(into_a, 0), out_of_b


def _stick(name: str, force: float, speed: float, bristle: float) -> tuple:
    coulomb = size("Fc", "N", force, 100 * force, "Coulomb friction", dry=True)
    return (
        off_library(
            name,
            "saturated line",
            "Karnopp, J. Dynamic Systems, Measurement and Control 107(1), 1985",
            {_SLOTS[name]: _line},
            (coulomb, shape("v0", "m/s", speed, "half the band about standstill")),
        ),
        off_library(
            name,
            "dahl",
            "Dahl, A Solid Friction Model, Aerospace Corporation TOR-158(3107-18), 1968",
            {_SLOTS[name]: _dahl},
            (coulomb, shape("d", "m", bristle, "travel in which it turns")),
            (EffectState("z", "1", 1.0),),
        ),
    )


_SLOTS = {"main.stiction": "main_friction", "jack.friction": "friction"}
_CURRENT = EffectState("w", "A", 0.02)
_OVERLAP = size("overlap", "1", 0.01, 0.3, "over full travel")
_GAIN = size("a", "1", 0.1, 0.6, "gain more on one side")

EFFECTS = (
    off_library(
        "pilot.hysteresis",
        "generalised play",
        "Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996, sec. 2.3",
        {"motor_current": _generalised_play},
        (size("up", "A", 3e-4, 5e-3, "upper edge"), size("down", "A", 2e-4, 5e-3, "lower edge")),
        (_CURRENT,),
    ),
    off_library(
        "pilot.hysteresis",
        "dahl squared",
        "Dahl, AIAA Journal 14(12), 1976: exponent 2",
        {"motor_current": _dahl_loop},
        (size("r", "A", 3e-4, 5e-3, "half the width of the loop"), shape("width", "A", 6e-4, "where it turns")),
        (_CURRENT, EffectState("z", "1", 1.0)),
    ),
    *_stick("main.stiction", 20.0, 2e-3, 4e-6),
    *_stick("jack.friction", 500.0, 4e-3, 8e-5),
    off_library(
        "main.deadband",
        "bare lap",
        "lap of Salazar Garcia et al., ICINCO 2007, shifted",
        {"main_openings": _bare_lap},
        (_OVERLAP,),
    ),
    off_library("main.deadband", "cubic", "a smooth dead zone without corners", {"main_openings": _cubic}, (_OVERLAP,)),
    off_library(
        "main.deadband",
        "round ports",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 5.2: circular ports",
        {"main_openings": _round_ports},
        (_OVERLAP,),
    ),
    off_library("main.asymmetry", "bent", "a gain that grows with the opening", {"main_openings": _bent}, (_GAIN,)),
    off_library("main.asymmetry", "one edge", "one worn metering edge", {"main_flows": _one_edge}, (_GAIN,)),
)
