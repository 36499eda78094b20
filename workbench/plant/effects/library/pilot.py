"""pilot.hysteresis: the torque motor's magnetic hysteresis, between the measured current [A] and the one that acts.

Every formula is driven by the current itself, never by its rate: a command held over a period makes the current jump.
"""

import casadi as ca

from ..decorator import effect, number, state
from ..effect import EffectState, Scope

_FAST = 5e-5  # s: a play operator is dragged along this fast; a loop does not depend on it below some 500 Hz
_PLAYS = 3

_SHOWS = "slow triangles of the command with reversals, with current and spool recorded"
_FAMILY = "spool stick"
_R = number("r", 2e-4, "A", shown="mA", low=0.0, high=5e-3, off=0.0, meaning="half the width of the loop")


def _state(name: str) -> EffectState:
    return state(name, "A", 0.02, memory=True)


def _held_back(current: ca.SX, s: Scope, dragged: str, half: ca.SX) -> ca.SX:
    """The part of the current that a play of half-width `half` [A] holds back; its state is dragged at its edges."""
    gap = current - s.x(dragged)
    behind = ca.fmax(ca.fmin(gap, half), -half)
    s.rate(dragged, (gap - behind) / _FAST)
    return behind


@effect(
    "pilot.hysteresis",
    "play",
    equation="pilot",
    family=_FAMILY,
    slot="motor_current",
    source="Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996, ch. 2: play operator",
    shows=_SHOWS,
    numbers=(_R,),
    states=(_state("w"),),
)
def play(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - sat(i - w, r), T0 w' = (i - w) - sat(i - w, r), T0 = 50 us: backlash of half-width r."""
    return current - _held_back(current, s, "w", s.p("r"))


@effect(
    "pilot.hysteresis",
    "prandtl-ishlinskii",
    equation="pilot",
    family=_FAMILY,
    slot="motor_current",
    source="Kuhnen, European Journal of Control 9(4), 2003: superposition of plays",
    shows=_SHOWS,
    numbers=(_R,),
    states=tuple(_state(f"w{j}") for j in range(1, _PLAYS + 1)),
)
def prandtl_ishlinskii(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - sum over j = 1..3 of sat(i - wj, rj)/4, T0 wj' = (i - wj) - sat(i - wj, rj), rj = 2 j r/3.

    After a turn the slope is 1/4, then 1/2, 3/4 and 1; half the width of a large loop is r.
    """
    parts = [_held_back(current, s, f"w{j}", s.p("r") * j * 2 / 3) for j in range(1, _PLAYS + 1)]
    return current - ca.sum1(ca.vertcat(*parts)) / (_PLAYS + 1)


@effect(
    "pilot.hysteresis",
    "bouc-wen",
    equation="pilot",
    family=_FAMILY,
    slot="motor_current",
    source="Wen, Journal of the Engineering Mechanics Division ASCE 102(2), 1976",
    shows=_SHOWS,
    numbers=(
        number("a", 0.2, "1", low=0.0, high=0.5, off=0.0, meaning="half the width of the loop over `width`"),
        number("width", 1e-3, "A", shown="mA", low=1e-4, high=1e-2, meaning="current over which the loop turns"),
    ),
    states=(_state("w"), state("z", "1", 1.0)),
)
def bouc_wen(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - a width z, z' = (di - |di| z)/width, di = (i - w)/T0 = w': Bouc-Wen with n = 1, T0 = 50 us.

    Half the width of the loop is a width; where it turns, the slope is 1 - 2 a: above a = 0.5 it would turn back.
    """
    rate = (current - s.x("w")) / _FAST
    s.rate("w", rate)
    s.rate("z", (rate - ca.fabs(rate) * s.x("z")) / s.p("width"))
    return current - s.p("a") * s.p("width") * s.x("z")
