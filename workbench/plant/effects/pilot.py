"""pilot.hysteresis: the torque motor's magnetic hysteresis, between the measured current [A] and the one that acts.

Every formula is driven by the current itself, never by its rate: a command held over a period makes the current jump.
"""

import casadi as ca

from .effect import Effect, EffectNumber, EffectState, Scope

_FAST = 5e-5  # s: a play operator is dragged along this fast; a loop does not depend on it below some 500 Hz
_PLAYS = 3


def _play_of(current: ca.SX, s: Scope, state: str, half: ca.SX) -> ca.SX:
    """The part of the current that a play of half-width `half` [A] holds back; `state` is dragged at its edges."""
    gap = current - s.x(state)
    held = ca.fmax(ca.fmin(gap, half), -half)
    s.rate(state, (gap - held) / _FAST)
    return held


def _play(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - sat(i - w, r), T0 w' = (i - w) - sat(i - w, r), T0 = 50 us: backlash of half-width r."""
    return current - _play_of(current, s, "w", s.p("r"))


def _prandtl_ishlinskii(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - sum over j = 1..3 of sat(i - wj, rj)/2, T0 wj' = (i - wj) - sat(i - wj, rj), rj = j r/3."""
    held = [_play_of(current, s, f"w{j}", s.p("r") * j / _PLAYS) for j in range(1, _PLAYS + 1)]
    return current - ca.sum1(ca.vertcat(*held)) / 2


def _bouc_wen(current: ca.SX, s: Scope) -> ca.SX:
    """acting = i - a width z, z' = (di - |di| z)/width, di = (i - w)/T0 = w': Bouc-Wen with n = 1, T0 = 50 us.

    Half the width of the loop is a width; where it turns, the slope is 1 - 2 a: above a = 0.5 it would turn back.
    """
    rate = (current - s.x("w")) / _FAST
    s.rate("w", rate)
    s.rate("z", (rate - ca.fabs(rate) * s.x("z")) / s.p("width"))
    return current - s.p("a") * s.p("width") * s.x("z")


_R = EffectNumber("r", "A", "mA", 3e-4, 0.0, 5e-3, "half the width of the loop", off=0.0)
_SHOWS = "slow triangles of the command with reversals, with current and spool recorded"


def _current_state(name: str) -> EffectState:
    return EffectState(name, "A", 0.02)


EFFECTS = (
    Effect(
        "pilot.hysteresis",
        "play",
        "pilot",
        "Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996, sec. 2.1: play operator",
        _SHOWS,
        {"motor_current": _play},
        (_R,),
        (_current_state("w"),),
        family="spool stick",
    ),
    Effect(
        "pilot.hysteresis",
        "prandtl-ishlinskii",
        "pilot",
        "Kuhnen, European Journal of Control 9(4), 2003: superposition of plays",
        _SHOWS,
        {"motor_current": _prandtl_ishlinskii},
        (_R,),
        tuple(_current_state(f"w{j}") for j in range(1, _PLAYS + 1)),
        family="spool stick",
    ),
    Effect(
        "pilot.hysteresis",
        "bouc-wen",
        "pilot",
        "Wen, Journal of the Engineering Mechanics Division ASCE 102(2), 1976, eq. 2",
        _SHOWS,
        {"motor_current": _bouc_wen},
        (
            EffectNumber("a", "1", "1", 0.3, 0.0, 0.5, "half the width of the loop over `width`", off=0.0),
            EffectNumber("width", "A", "mA", 1e-3, 1e-4, 1e-2, "current over which the loop turns"),
        ),
        (_current_state("w"), EffectState("z", "1", 1.0)),
        family="spool stick",
    ),
)
