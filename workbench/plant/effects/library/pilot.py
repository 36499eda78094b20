"""pilot.hysteresis: magnetic hysteresis of the torque motor or magnet in front of a spool.

Where a pilot is modelled it acts between the measured current [A] and the one that makes torque; where a valve is known
by its datasheet alone, on the command [1], in the formulas "magnet ...". Every formula is driven by the signal itself,
never by its rate: a command held over a period makes it jump.
"""

from dataclasses import dataclass
from functools import partial

import casadi as ca

from ..decorator import effect, number, state
from ..effect import Effect, EffectState, Scope

_FAST = 5e-5  # s: a play operator is dragged along this fast; a loop does not depend on it below some 500 Hz
_PLAYS = 3


@dataclass(frozen=True)
class _Magnet:
    """A place of hysteresis: slot, start of the formulas' names, unit, signal, size, what shows it."""

    slot: str
    title: str
    unit: str
    shown: str
    signal: str
    scale: float
    typical: float
    highest: float
    shows: str


_TORQUE_MOTOR = _Magnet(
    "motor_current",
    "",
    "A",
    "mA",
    "current",
    scale=0.02,
    typical=2e-4,
    highest=5e-3,
    shows="slow triangles of the command with reversals, with current and spool recorded",
)
_IN_FRONT = _Magnet(
    "magnet",
    "magnet ",
    "1",
    "%",
    "command",
    scale=1.0,
    typical=0.02,
    highest=0.25,
    shows="slow triangles of the command with reversals, with spool or position recorded",
)


def _held_back(value: ca.SX, s: Scope, dragged: str, half: ca.SX) -> ca.SX:
    """The part of a signal that a play of half-width `half` holds back; its state is dragged at its edges."""
    gap = value - s.x(dragged)
    behind = ca.fmax(ca.fmin(gap, half), -half)
    s.rate(dragged, (gap - behind) / _FAST)
    return behind


def _formulas(of: _Magnet) -> tuple[Effect, ...]:
    def memory(name: str) -> EffectState:
        return state(name, of.unit, of.scale, memory=True)

    r = number(
        "r",
        of.typical,
        of.unit,
        shown=of.shown,
        low=0.0,
        high=of.highest,
        off=0.0,
        meaning="half the width of the loop",
    )
    here = partial(effect, "pilot.hysteresis", equation="pilot", family="spool stick", slot=of.slot, shows=of.shows)

    @here(
        f"{of.title}play",
        source="Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996, ch. 2: play operator",
        numbers=(r,),
        states=(memory("w"),),
    )
    def play(value: ca.SX, s: Scope) -> ca.SX:
        """acting = i - sat(i - w, r), T0 w' = (i - w) - sat(i - w, r), T0 = 50 us: backlash of half-width r."""
        return value - _held_back(value, s, "w", s.p("r"))

    @here(
        f"{of.title}prandtl-ishlinskii",
        source="Kuhnen, European Journal of Control 9(4), 2003: superposition of plays",
        numbers=(r,),
        states=tuple(memory(f"w{j}") for j in range(1, _PLAYS + 1)),
    )
    def prandtl_ishlinskii(value: ca.SX, s: Scope) -> ca.SX:
        """acting = i - sum over j = 1..3 of sat(i - wj, rj)/4, T0 wj' = (i - wj) - sat(i - wj, rj), rj = 2 j r/3.

        After a turn the slope is 1/4, then 1/2, 3/4 and 1; half the width of a large loop is r.
        """
        parts = [_held_back(value, s, f"w{j}", s.p("r") * j * 2 / 3) for j in range(1, _PLAYS + 1)]
        return value - ca.sum1(ca.vertcat(*parts)) / (_PLAYS + 1)

    @here(
        f"{of.title}bouc-wen",
        source="Wen, Journal of the Engineering Mechanics Division ASCE 102(2), 1976",
        numbers=(
            number("a", 0.2, "1", low=0.0, high=0.5, off=0.0, meaning="half the width of the loop over `width`"),
            number(
                "width",
                5 * of.typical,
                of.unit,
                shown=of.shown,
                low=of.typical / 2,
                high=2 * of.highest,
                meaning=f"{of.signal} over which the loop turns",
            ),
        ),
        states=(memory("w"), state("z", "1", 1.0, memory=True)),
    )
    def bouc_wen(value: ca.SX, s: Scope) -> ca.SX:
        """acting = i - a width z, z' = (di - |di| z)/width, di = (i - w)/T0 = w': Bouc-Wen with n = 1, T0 = 50 us.

        Half the width of the loop is a width; where it turns, the slope is 1 - 2 a: above a = 0.5 it would turn back.
        """
        rate = (value - s.x("w")) / _FAST
        s.rate("w", rate)
        s.rate("z", (rate - ca.fabs(rate) * s.x("z")) / s.p("width"))
        return value - s.p("a") * s.p("width") * s.x("z")

    return play, prandtl_ishlinskii, bouc_wen


play, prandtl_ishlinskii, bouc_wen = _formulas(_TORQUE_MOTOR)
magnet_play, magnet_prandtl_ishlinskii, magnet_bouc_wen = _formulas(_IN_FRONT)
