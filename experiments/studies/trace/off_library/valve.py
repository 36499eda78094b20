"""Valve otherwise than in the library: hysteresis, spool friction, laps and unequal gains."""

import casadi as ca

from workbench.plant.effects import EffectState, Scope
from workbench.plant.orifice import exponential_lap

from .formula import DATASHEET, off_library, shape, size, smooth_sign

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


def _jumping(command: ca.SX, s: Scope) -> ca.SX:
    """u + jump u/(|u| + 0.004): a drive that steps over the dead band, the less the less it is asked."""
    return command + s.p("jump") * command / (ca.fabs(command) + 4e-3)


def _rounded_rate(asked: ca.SX, s: Scope) -> ca.SX:
    """vd/(1 + (vd T/zmax)^2)^(1/2): a pilot whose flow tends to its end."""
    ratio = asked * s.p("T") / s["travel"]
    return asked / ca.sqrt(1 + ratio * ratio)


def _rate_of_the_opening_side(asked: ca.SX, s: Scope) -> ca.SX:
    """As above with 2 T one way: a spring helps the pilot the other way."""
    ratio = asked * s.p("T") * (1 + ca.tanh(asked / (0.1 * s["travel"]))) / s["travel"]
    return asked / ca.sqrt(1 + ratio * ratio)


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


def _stick(name: str, force: float, speed: float, bristle: float, unit: str = "N", title: str = "") -> tuple:
    coulomb = size("Fc", unit, force, 100 * force if unit == "N" else 0.3, "Coulomb friction", dry=True)
    slot = _SLOTS[title + name]
    return (
        off_library(
            name,
            f"{title}saturated line",
            "Karnopp, J. Dynamic Systems, Measurement and Control 107(1), 1985",
            {slot: _line},
            (coulomb, shape("v0", "m/s", speed, "half the band about standstill")),
        ),
        off_library(
            name,
            f"{title}dahl",
            "Dahl, A Solid Friction Model, Aerospace Corporation TOR-158(3107-18), 1968",
            {slot: _dahl},
            (coulomb, shape("d", "m", bristle, "travel in which it turns")),
            (EffectState("z", "1", 1.0),),
        ),
    )


_SLOTS = {
    "main.stiction": "main_friction",
    "jack.friction": "friction",
    "relative main.stiction": "spool_friction",
}
_CURRENT = EffectState("w", "A", 0.02)
_OVERLAP = size("overlap", "1", 0.01, 0.6, "over full travel")
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
    off_library(
        "pilot.hysteresis",
        "magnet generalised play",
        "Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996, sec. 2.3",
        {"magnet": _generalised_play},
        (size("up", "1", 0.02, 0.25, "upper edge"), size("down", "1", 0.013, 0.25, "lower edge")),
        (EffectState("w", "1", 1.0),),
    ),
    off_library(
        "pilot.hysteresis",
        "magnet dahl squared",
        "Dahl, AIAA Journal 14(12), 1976: exponent 2",
        {"magnet": _dahl_loop},
        (size("r", "1", 0.02, 0.25, "half the width of the loop"), shape("width", "1", 0.04, "where it turns")),
        (EffectState("w", "1", 1.0), EffectState("z", "1", 1.0)),
    ),
    *_stick("main.stiction", 20.0, 2e-3, 4e-6),
    *_stick("main.stiction", 0.02, 2e-3, 4e-6, "1", "relative "),
    *(
        off_library(
            "main.rate",
            title,
            "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 7: pilot flow, here without a corner",
            {"spool_speed": law},
            (size("T", "s", 0.025, 1.0, "time of full travel at most"),),
        )
        for title, law in (("rounded", _rounded_rate), ("rounded, unequal", _rate_of_the_opening_side))
    ),
    off_library(
        "main.deadband",
        "cubic, with jump",
        "a smooth dead zone behind a drive that steps over it",
        {"command": _jumping, "main_openings": _cubic},
        (_OVERLAP, size("jump", "1", 0.006, 0.3, "what the drive adds to its command")),
        kinds=DATASHEET,
    ),
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
