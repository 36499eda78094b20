"""load.backlash: play between the rod and what it carries, with position and acceleration measured on either side.

A share mu of the moving mass is behind the play; y [m] is how far it is ahead of the rod. Where the gap is closed, a
stiff contact carries it.
"""

from collections.abc import Mapping
from functools import partial

import casadi as ca

from ..decorator import Law, effect, number, state
from ..effect import Scope

_SOFT = 0.01  # of the gap, over which the damping of the contact comes

_play = partial(
    effect,
    "load.backlash",
    equation="force",
    slot="acceleration",
    source="Nordin, Gutman, Automatica 38(10), 2002: controlling mechanical systems with backlash, a survey",
    shows="slow reversals under little load, and fast multisines, with position and acceleration recorded",
    numbers=(
        number(
            "mu",
            0.8,
            "1",
            shown="%",
            low=0.0,
            high=0.95,
            off=0.0,
            meaning="share of the moving mass behind the play",
            tried=(0.5, 0.9),
        ),
        number("gap", 2e-4, "m", shown="mm", low=0.0, high=5e-3, meaning="the whole play", tried=(5e-5, 1e-3)),
        number("f", 200.0, "Hz", low=20.0, high=2000.0, meaning="frequency of that share on the closed contact"),
        number("zeta", 0.3, "1", low=0.02, high=2.0, meaning="damping ratio of the closed contact"),
    ),
    states=(state("y", "m", 1e-4, across=("vy", "gap")), state("vy", "m/s", 1e-2)),
)


def _pull(s: Scope) -> ca.SX:
    """Force of the contact on the share behind the play, over its mass [m/s^2]."""
    half, w0 = s.p("gap") / 2, 2 * ca.pi * s.p("f")
    into = s.x("y") - ca.fmax(ca.fmin(s.x("y"), half), -half)
    closed = ca.fabs(into) / (ca.fabs(into) + _SOFT * s.p("gap") + 1e-9)
    return w0 * w0 * into + 2 * s.p("zeta") * w0 * s.x("vy") * closed


def _carried(acceleration: ca.SX, s: Scope) -> ca.SX:
    pull, share = _pull(s), s.p("mu")
    rod = (acceleration + share * pull) / (1 - share)
    s.rate("y", s.x("vy"))
    s.rate("vy", -rod - pull)
    return rod


def _there(s: Scope, value: ca.SX) -> ca.SX:
    """What the share behind the play adds to a signal; nothing where there is none."""
    return ca.if_else(s.p("mu") > 0, value, 0)


def _position(position: ca.SX, s: Scope) -> ca.SX:
    """x + y."""
    return position + _there(s, s.x("y"))


def _velocity(velocity: ca.SX, s: Scope) -> ca.SX:
    """v + y'."""
    return velocity + _there(s, s.x("vy"))


def _acceleration(acceleration: ca.SX, s: Scope) -> ca.SX:
    """a + y'' = -pull."""
    return acceleration + _there(s, -acceleration - _pull(s))


_ON_THE_LOAD: Mapping[str, Law] = {
    "sensor_position": _position,
    "sensor_velocity": _velocity,
    "sensor_acceleration": _acceleration,
}


@_play("measured on the rod")
def on_the_rod(acceleration: ca.SX, s: Scope) -> ca.SX:
    """(1 - mu) a = F/M + mu p, y'' = -a - p, p = w0^2 d + 2 zeta w0 y' |d|/(|d| + gap/100), d = y - sat(y, gap/2).

    w0 = 2 pi f. The contact pulls where the gap is closed, and damps with how far it is closed.
    """
    return _carried(acceleration, s)


@_play("measured on the load", also=_ON_THE_LOAD)
def on_the_load(acceleration: ca.SX, s: Scope) -> ca.SX:
    """The formula "measured on the rod", with x + y, v + y' and a + y'' where position, velocity and acceleration are
    measured."""
    return _carried(acceleration, s)
