"""Friction and load otherwise than in the library."""

import casadi as ca

from workbench.plant.effects import EffectState, Scope

from .formula import off_library, shape, size, smooth_sign


def _three_halves(friction: ca.SX, s: Scope) -> ca.SX:
    """F = [Fc + (Fs - Fc) exp(-|v/vs|^1.5)] v/sqrt(v^2 + v0^2), v0 = 1 mm/s."""
    speed = s["velocity"]
    ratio = ca.sqrt(speed * speed + 1e-12) / s.p("vs")
    level = s.p("Fc") + (s.p("Fs") - s.p("Fc")) * ca.exp(-ratio * ca.sqrt(ratio))
    return friction + level * smooth_sign(speed, 1e-3)


def _hyperbolic(friction: ca.SX, s: Scope) -> ca.SX:
    """F = [Fc + (Fs - Fc)/(1 + (v/vs)^2)] 2/pi atan(v/v0), v0 = 1 mm/s."""
    speed = s["velocity"]
    ratio = speed / s.p("vs")
    level = s.p("Fc") + (s.p("Fs") - s.p("Fc")) / (1 + ratio * ratio)
    return friction + level * 2 / ca.pi * ca.atan(speed / 1e-3)


def _pressed(friction: ca.SX, s: Scope) -> ca.SX:
    """F = Fc (1 + |pA - pB|/p1) tanh(v/v0), v0 = 3 mm/s: seals that pressure pushes on."""
    pushed = 1 + ca.sqrt(s["drop"] * s["drop"] + 1e8) / s.p("p1")
    return friction + s.p("Fc") * pushed * ca.tanh(s["velocity"] / 3e-3)


def _link(force: ca.SX, s: Scope) -> ca.SX:
    """F cos(x/r): a weight that hangs on a link."""
    return force + s.p("F") * ca.cos(s["position"] / s.p("r"))


def _softening(force: ca.SX, s: Scope) -> ca.SX:
    """k x/sqrt(1 + (x/x1)^2): a spring that yields."""
    ratio = s["position"] / s.p("x1")
    return force + s.p("k") * s["position"] / ca.sqrt(1 + ratio * ratio)


def _square_damping(acceleration: ca.SX, s: Scope) -> ca.SX:
    """As the library's hanging load, its damper giving c y' |y'|: (1 - mu) a = F/M + mu (w0^2 y + c y' |y'|)."""
    return _hung(acceleration, s, s.p("c") * s.x("vy") * ca.fabs(s.x("vy")))


def _rubber(acceleration: ca.SX, s: Scope) -> ca.SX:
    """A hanging load on a Zener spring: a second spring, k2 w0^2, behind a damper that relaxes in tau."""
    gap = s.x("y") - s.x("q")
    s.rate("q", gap / s.p("tau"))
    w0 = 2 * ca.pi * s.p("f")
    return _hung(acceleration, s, s.p("k2") * w0 * w0 * gap)


def _round_contact(acceleration: ca.SX, s: Scope) -> ca.SX:
    """A hanging load behind a play: w0^2 d (|d|/(gap/2))^0.5, d = y - sat(y, gap/2), and 0.2 w0 y' in the contact."""
    half, w0 = s.p("gap") / 2, 2 * ca.pi * s.p("f")
    into = s.x("y") - ca.fmax(ca.fmin(s.x("y"), half), -half)
    depth = ca.sqrt((ca.fabs(into) + 1e-9) / half)
    contact = w0 * w0 * into * depth + 0.2 * w0 * s.x("vy") * ca.fmin(depth, 1)
    return _hung(acceleration, s, contact - w0 * w0 * s.x("y"))


def _hung(acceleration: ca.SX, s: Scope, damping: ca.SX) -> ca.SX:
    w0, share = 2 * ca.pi * s.p("f"), s.p("mu")
    pull = w0 * w0 * s.x("y") + damping
    carried = (acceleration + share * pull) / (1 - share)
    s.rate("y", s.x("vy"))
    s.rate("vy", -carried - pull)
    return carried


_COULOMB = size("Fc", "N", 500.0, 2e4, "Coulomb friction", dry=True)
_STATIC = size("Fs", "N", 900.0, 4e4, "break-away friction", dry=True)
_STRIBECK = shape("vs", "m/s", 0.03, "Stribeck speed")
_MU = size("mu", "1", 0.2, 0.9, "share of the moving mass that hangs")
_F = shape("f", "Hz", 70.0, "its frequency with the rod held")
_Y = (EffectState("y", "m", 1e-3), EffectState("vy", "m/s", 1.0))

EFFECTS = (
    off_library(
        "jack.friction",
        "stribeck 3/2",
        "Armstrong-Helouvry et al., Automatica 30(7), 1994: exponent between 1/2 and 2",
        {"friction": _three_halves},
        (_COULOMB, _STATIC, _STRIBECK),
    ),
    off_library(
        "jack.friction",
        "hyperbolic",
        "Hess, Soom, J. Tribology 112(1), 1990",
        {"friction": _hyperbolic},
        (_COULOMB, _STATIC, _STRIBECK),
    ),
    off_library(
        "jack.friction",
        "pressed seals",
        "Bonchis, Corke, Rye, IEEE Trans. Control Systems Technology 7(2), 1999: friction with pressure",
        {"friction": _pressed},
        (_COULOMB, shape("p1", "Pa", 5e6, "difference that doubles it")),
    ),
    off_library(
        "load.bias",
        "weight on a link",
        "statics",
        {"body_force": _link},
        (size("F", "N", 3e3, 1e5, "weight"), shape("r", "m", 0.6, "of the link")),
    ),
    off_library(
        "load.spring",
        "softening",
        "a rubber block",
        {"load": _softening},
        (size("k", "N/m", 1e5, 1e7, "stiffness"), shape("x1", "m", 0.1, "travel at which it yields")),
    ),
    off_library(
        "load.compliance",
        "square damping",
        "Den Hartog, Mechanical Vibrations, 4th ed. 1956, sec. 8.4",
        {"acceleration": _square_damping},
        (_MU, _F, shape("c", "1/m", 60.0, "damping over speed")),
        _Y,
    ),
    off_library(
        "load.compliance",
        "rubber",
        "Zener, Elasticity and Anelasticity of Metals, Chicago 1948",
        {"acceleration": _rubber},
        (_MU, _F, shape("k2", "1", 0.3, "second stiffness over the first"), shape("tau", "s", 3e-3, "relaxation")),
        (*_Y, EffectState("q", "m", 1e-3)),
    ),
    off_library(
        "load.backlash",
        "round contact",
        "Hertz, J. reine angew. Math. 92, 1881: force with the power 3/2 of the approach",
        {"acceleration": _round_contact},
        (_MU, _F, shape("gap", "m", 2e-4, "the whole play")),
        _Y,
    ),
)
