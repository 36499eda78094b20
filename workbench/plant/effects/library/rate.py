"""main.rate: the spool's speed is limited, by the flow of a pilot that the model has not.

Strength is the time T [s] of full travel at that speed: at 0 the speed is free. vd [m/s] is the
speed that the drive asks for, v the one that the spool has.
"""

from functools import partial

import casadi as ca

from ..decorator import effect, number
from ..effect import EffectNumber, Scope

_PILOT = (
    "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 7: two-stage valve, the spool's speed is pilot flow over area"
)

_ROUND = 0.02  # of the largest speed, over which its acceleration ends


def _time(name: str, meaning: str) -> EffectNumber:
    return number(name, 0.025, "s", shown="ms", low=0.0, high=1.0, off=0.0, meaning=meaning, tried=(0.1,))


_rate = partial(
    effect,
    "main.rate",
    equation="main",
    family="spool stick",
    slot="spool_speed",
    shows="large fast steps and multisines of the command, with spool or position recorded",
)


def _at_most(asked: ca.SX, s: Scope, share: ca.SX) -> ca.SX:
    """v + (vd - v) k, k falling from 1 to 0 over the last 2 % of the largest speed; `share` is v over that speed."""
    onward = ca.fmax(ca.fmin((1 - share) / _ROUND, 1), 0)
    return s["velocity"] + (asked - s["velocity"]) * onward


@_rate("symmetric", source=_PILOT, numbers=(_time("T", "time of full travel"),))
def symmetric(asked: ca.SX, s: Scope) -> ca.SX:
    """vd' = v + (vd - v) sat01((1 - |v| T/zmax)/0.02) where vd is beyond v, else vd: no faster than zmax/T."""
    v = s["velocity"]
    limited = _at_most(asked, s, ca.fabs(v) * s.p("T") / s["travel"])
    return ca.if_else((asked - v) * v > 0, limited, asked)


@_rate(
    "two-sided",
    source=f"{_PILOT}; a flow of its own each way",
    numbers=(_time("T_up", "time of full travel towards positive"), _time("T_down", "time of full travel back")),
)
def two_sided(asked: ca.SX, s: Scope) -> ca.SX:
    """The formula "symmetric" with T = T_up where v > 0, T_down where it is not."""
    v = s["velocity"]
    limited = _at_most(asked, s, ca.fmax(v * s.p("T_up"), -v * s.p("T_down")) / s["travel"])
    return ca.if_else((asked - v) * v > 0, limited, asked)


@_rate(
    "demand",
    source=f"{_PILOT}; the pilot's stroke saturates, the speed follows it",
    numbers=(_time("T", "time of full travel"),),
)
def demand(asked: ca.SX, s: Scope) -> ca.SX:
    """vd' = vd/max(1, |vd| T/zmax): the drive asks for no more than zmax/T."""
    return asked / ca.fmax(1, ca.fabs(asked) * s.p("T") / s["travel"])
