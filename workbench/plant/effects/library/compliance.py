"""load.compliance: something gives that the rig takes as rigid: part of the load, or the mount of the cylinder.

From the valve both are one: with a force F between rod and body, and nothing else on the mass M, the rod moves against
the body by F (1/(M s^2) + A/(s^2 + 2 z w s + w^2)), a mass and one mode. Of the mount w is w0, z its zeta and
A = c w0^2; of the load w = w0/sqrt(1 - mu), z = zeta/sqrt(1 - mu) and A = mu/((1 - mu) M). So neither the position nor
the pressures tell them apart; an accelerometer on the rod does.
"""

from functools import partial

import casadi as ca

from ..decorator import effect, number, state
from ..effect import Scope

_SPACED = tuple(round(8 * 1.3**k, 1) for k in range(13))  # Hz, up to 190: nearer than a resonance is wide
_ZETA = number("zeta", 0.03, "1", low=0.0, high=1.0, meaning="its damping ratio")
_compliance = partial(
    effect,
    "load.compliance",
    equation="force",
    slot="acceleration",
    shows="fast multisine and steps on the command, with acceleration, force or both pressures recorded",
    states=(state("y", "m", 1e-3), state("vy", "m/s", 1.0)),
)


@_compliance(
    "load",
    source="Den Hartog, Mechanical Vibrations, 4th ed. 1956, ch. 3: two degrees of freedom",
    numbers=(
        number("mu", 0.3, "1", shown="%", low=0.0, high=0.9, off=0.0, meaning="share of the moving mass on the spring"),
        number("f", 60.0, "Hz", low=5.0, high=500.0, meaning="its frequency with the rod held", tried=_SPACED),
        _ZETA,
    ),
)
def hanging_load(acceleration: ca.SX, s: Scope) -> ca.SX:
    """(1 - mu) a = F/M + mu (w0^2 y + 2 zeta w0 y'), y'' = -a - w0^2 y - 2 zeta w0 y', w0 = 2 pi f.

    A share mu of the moving mass hangs on a spring and a damper behind the rod; y [m] is how far it is ahead. The
    accelerometer is on the other share, which the rod moves.
    """
    y, speed, share, w0 = s.x("y"), s.x("vy"), s.p("mu"), 2 * ca.pi * s.p("f")
    pull = w0 * w0 * y + 2 * s.p("zeta") * w0 * speed
    carried = (acceleration + share * pull) / (1 - share)
    s.rate("y", speed)
    s.rate("vy", -carried - pull)
    return carried


def _moved(motion: tuple[ca.SX, ca.SX], s: Scope) -> tuple[ca.SX, ca.SX]:
    """The piston moves in the cylinder by x - y and v - y'; y [m] is the travel of the cylinder's body."""
    x, v = motion
    return x - s.x("y"), v - s.x("vy")


@_compliance(
    "mount",
    also={"piston": _moved},
    source="Den Hartog, Mechanical Vibrations, 4th ed. 1956, ch. 3: two degrees of freedom",
    numbers=(
        number("c", 5e-9, "m/N", shown="um/kN", low=0.0, high=1e-6, off=0.0, meaning="compliance of the mount"),
        number("f", 100.0, "Hz", low=5.0, high=1000.0, meaning="frequency of the cylinder's body on it", tried=_SPACED),
        _ZETA,
    ),
)
def mount(acceleration: ca.SX, s: Scope) -> ca.SX:
    """y'' = -w0^2 (y + c F) - 2 zeta w0 y', w0 = 2 pi f: the rod force F pushes the body back on its mount.

    The position sensor sees the rod against the body, the accelerometer the mass against the ground.
    """
    w0 = 2 * ca.pi * s.p("f")
    s.rate("y", s.x("vy"))
    s.rate("vy", -w0 * w0 * (s.x("y") + s.p("c") * s["rod_force"]) - 2 * s.p("zeta") * w0 * s.x("vy"))
    return acceleration
