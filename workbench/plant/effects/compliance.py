"""load.compliance: something gives that the rig takes as rigid: part of the load, or the mount of the cylinder."""

import casadi as ca

from .effect import Effect, EffectNumber, EffectState, Scope


def _hanging_load(acceleration: ca.SX, s: Scope) -> ca.SX:
    """(1 - mu) a = F/M + mu (w0^2 y + 2 zeta w0 y'), y'' = -a - w0^2 y - 2 zeta w0 y'.

    A share mu of the moving mass hangs on a spring and a damper behind the rod; y [m] is how far it is ahead.
    """
    y, speed, share, w0 = s.x("y"), s.x("vy"), s.p("mu"), 2 * ca.pi * s.p("f")
    pull = w0 * w0 * y + 2 * s.p("zeta") * w0 * speed
    carried = (acceleration + share * pull) / (1 - share)
    s.rate("y", speed)
    s.rate("vy", -carried - pull)
    return carried


def _moved_mount(motion: tuple[ca.SX, ca.SX], s: Scope) -> tuple[ca.SX, ca.SX]:
    """The piston moves in the cylinder by x - y and v - y'; y [m] is the travel of the cylinder's body."""
    x, v = motion
    return x - s.x("y"), v - s.x("vy")


def _mount(acceleration: ca.SX, s: Scope) -> ca.SX:
    """y'' = -w0^2 (y + c F) - 2 zeta w0 y': the rod force F pushes the body back on a mount of compliance c."""
    w0 = 2 * ca.pi * s.p("f")
    s.rate("y", s.x("vy"))
    s.rate("vy", -w0 * w0 * (s.x("y") + s.p("c") * s["rod_force"]) - 2 * s.p("zeta") * w0 * s.x("vy"))
    return acceleration


_SHOWS = "fast multisine and steps on the command, with acceleration, force or both pressures recorded"
_STATES = (EffectState("y", "m", 1e-3), EffectState("vy", "m/s", 1.0))
_ZETA = EffectNumber("zeta", "1", "1", 0.03, 0.0, 1.0, "its damping ratio")

EFFECTS = (
    Effect(
        "load.compliance",
        "load",
        "force",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 6.7: structural resonance of the load",
        _SHOWS,
        {"acceleration": _hanging_load},
        (
            EffectNumber("mu", "1", "%", 0.3, 0.0, 0.9, "share of the moving mass that hangs on the spring", off=0.0),
            EffectNumber("f", "Hz", "Hz", 60.0, 5.0, 500.0, "its frequency with the rod held"),
            _ZETA,
        ),
        _STATES,
    ),
    Effect(
        "load.compliance",
        "mount",
        "force",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 6.7: compliance of the actuator's mount",
        _SHOWS,
        {"piston": _moved_mount, "acceleration": _mount},
        (
            EffectNumber("c", "m/N", "um/kN", 1e-8, 0.0, 1e-6, "compliance of the mount", off=0.0),
            EffectNumber("f", "Hz", "Hz", 100.0, 10.0, 1000.0, "frequency of the cylinder's body on it"),
            _ZETA,
        ),
        _STATES,
    ),
)
