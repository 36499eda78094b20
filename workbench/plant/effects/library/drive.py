"""Drive effects, between the command and the pilot current: timing, a current limit, a corrector nobody declared."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca

from ....rigs.inner_loop import DELAY
from ..decorator import effect, number, state
from ..effect import Effect, Scope
from ..lag import first_order, second_order

_TIMING = "drive timing"
_FAST = "steps and fast multisine on the command, with current or spool recorded"
_LARGE = "large steps of the command, with current recorded"
_COIL = "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6: coil driven by an amplifier with current feedback"
_RAPP = "Rapp, 2nd European Conference on Satellite Communications, 1991"
_FILTER = "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998: prefilter"
_PID = "Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3: filtered derivative, back-calculation with Tt = Ti"
_ON_SPOOL = "Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3: derivative of the process variable, c = 0"

_OF_COMMAND: dict[str, Any] = {
    "kinds": ("second-order", "pump", "two-way-pump"),
    "elsewhere": "a pilot current in its model, of which other formulas of the effect are",
}
"""Of drives that end in a command of 1."""

_TAU = number("tau", 1e-3, "s", shown="ms", low=0.0, high=2e-2, off=0.0, meaning="time constant")
_KI = number("ki", 40.0, "1/s", low=0.0, high=500.0, off=0.0, meaning="integral rate 1/Ti")
_TD = number("Td", 5e-4, "s", shown="ms", low=0.0, high=3e-3, off=0.0, meaning="lead time")
_TF = number("tf", 5e-4, "s", shown="ms", low=1e-4, high=5e-3, meaning="filter of the lead")
_DELAY = number(
    "delay",
    2e-3,
    "s",
    shown="ms",
    low=0.0,
    high=2e-2,
    off=0.0,
    meaning="time by which the command is late",
    tried=(5e-4, 1e-3, 1.5e-3, 2.5e-3, 3.5e-3, 5e-3, 7e-3, 1e-2),
)
_SHARE = number(
    "share",
    0.08,
    "1",
    shown="%",
    low=0.02,
    high=1.0,
    off=1.0,
    meaning="limit over the declared one",
    tried=(0.03, 0.06, 0.12, 0.25),
)
_C0, _C1 = state("c0", "1", 1.0), state("c1", "1", 1.0)

shift = Effect(
    "drive.delay",
    "shift",
    "drive",
    "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 4: a held input, late",
    _FAST,
    {},
    (_DELAY,),
    family=_TIMING,
    delay="delay",
    described=DELAY,
)
"""The command is late: no law in the plant, whoever feeds it holds the command back."""

interpolated = replace(
    shift,
    formula="interpolated",
    source="linear interpolation between two samples",
    numbers=(replace(_DELAY, tried=()),),
    interpolated=True,
)
"""The command is late by a share of a period too, and the drive interpolates between the two samples."""


@effect(
    "drive.lag",
    "amplifier",
    equation="drive",
    family=_TIMING,
    slot="current",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 7: torque motor driven through its coil",
    shows=_FAST,
    numbers=(_TAU,),
    states=(state("i", "A", 0.02),),
)
def amplifier(current: ca.SX, s: Scope) -> ca.SX:
    """tau i' = demand - i: the current lags its demand."""
    return first_order(current, s, "i")


@effect(
    "drive.lag",
    "command filter",
    equation="drive",
    family=_TIMING,
    slot="command",
    source=_FILTER,
    shows=_FAST,
    numbers=(_TAU,),
    states=(state("c", "1", 1.0),),
)
def command_filter(command: ca.SX, s: Scope) -> ca.SX:
    """tau c' = command - c: the drive filters its command."""
    return first_order(command, s, "c")


def _two_poles(slot: str, title: str, unit: str, scale: float, bound: Mapping[str, Any]) -> Effect:
    @effect(
        "drive.lag",
        title,
        equation="drive",
        family=_TIMING,
        slot=slot,
        source=_COIL,
        shows=_FAST,
        numbers=(
            replace(_TAU, typical=5e-4, high=1e-2, meaning="1/(2 pi) of the period"),
            number("zeta", 0.8, "1", low=0.3, high=2.0, meaning="damping ratio"),
        ),
        states=(state("i", unit, scale), state("i_rate", unit, scale)),
        **bound,
    )
    def two_poles(current: ca.SX, s: Scope) -> ca.SX:
        """tau^2 i'' + 2 zeta tau i' + i = demand."""
        return second_order(current, s, "i")

    return two_poles


two_poles = _two_poles("current", "two poles", "A", 0.02, {})
command_two_poles = _two_poles("command", "command two poles", "1", 1.0, _OF_COMMAND)


def _saturations(slot: str, title: str, bound: Mapping[str, Any], shows: str) -> tuple[Effect, ...]:
    """The formulas of drive.saturation for the pilot's current, whose limit is declared, or for the command, at 1."""

    def limit(s: Scope) -> ca.SX:
        return s["limit"] if slot == "current" else ca.SX(1)

    here = partial(effect, "drive.saturation", equation="drive", slot=slot, shows=shows, **bound)

    @here(
        f"{title}hard",
        source="Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3: actuator saturation",
        numbers=(_SHARE,),
    )
    def hard(current: ca.SX, s: Scope) -> ca.SX:
        """|i| <= share * declared limit."""
        top = s.p("share") * limit(s)
        return ca.fmax(ca.fmin(current, top), -top)

    @here(
        f"{title}one-sided",
        source="Tietze, Schenk, Electronic Circuits, 2nd ed. 2008, ch. 15: push-pull stage, one transistor a half wave",
        numbers=(
            replace(_SHARE, meaning="higher limit over the declared one"),
            number(
                "less",
                0.4,
                "1",
                low=-0.95,
                high=0.95,
                off=0.0,
                meaning="what the upper limit, below 0 the lower, lacks",
            ),
        ),
    )
    def one_sided(current: ca.SX, s: Scope) -> ca.SX:
        """-share (1 + min(less, 0)) declared limit <= i <= share (1 - max(less, 0)) declared limit."""
        top = s.p("share") * limit(s)
        up, down = 1 - ca.fmax(s.p("less"), 0), 1 + ca.fmin(s.p("less"), 0)
        return ca.fmax(ca.fmin(current, up * top), -down * top)

    @here(
        f"{title}soft",
        source=f"{_RAPP}: amplifier that saturates smoothly, p = 1",
        numbers=(
            number(
                "c", 100.0, "1", low=0.0, high=2500.0, off=0.0, meaning="(declared limit over the current tended to)^2"
            ),
        ),
    )
    def soft(current: ca.SX, s: Scope) -> ca.SX:
        """i = demand/sqrt(1 + c (demand/limit)^2), limit the declared one: it tends to limit/sqrt(c)."""
        ratio = current / limit(s)
        return current / ca.sqrt(1 + s.p("c") * ratio * ratio)

    @here(
        f"{title}rapp",
        source=_RAPP,
        numbers=(
            number("c", 1.0, "1", low=0.0, high=1e4, off=0.0, meaning="(limit/10 over the current tended to)^(2 m)"),
            number("m", 2.0, "1", low=0.7, high=6.0, meaning="sharpness of the knee", tried=(1.0, 4.0)),
        ),
    )
    def rapp(current: ca.SX, s: Scope) -> ca.SX:
        """i = demand/(1 + c (10 |demand|/limit)^(2 m))^(1/(2 m)), limit the declared one."""
        twice = 2 * s.p("m")
        ratio = 10 * ca.fabs(current) / limit(s) + 1e-12
        return current / (1 + s.p("c") * ratio**twice) ** (1 / twice)

    return hard, one_sided, soft, rapp


hard, one_sided, soft, rapp = _saturations("current", "", {}, _LARGE)
command_hard, command_one_sided, command_soft, command_rapp = _saturations(
    "command", "command ", _OF_COMMAND, "large steps of the command, with spool, position or pressures recorded"
)


def _lead(demand: ca.SX, s: Scope, signal: str, sign: int = 1) -> ca.SX:
    """The demand and the filtered rate of a signal."""
    rate = (s[signal] - s.x("c1")) / s.p("tf")
    s.rate("c1", rate)
    return demand + sign * s["gain"] * s.p("Td") * rate


def _integral(demand: ca.SX, s: Scope) -> ca.SX:
    total = demand + s.x("c0")
    excess = ca.fmax(ca.fmin(total, s["limit"]), -s["limit"]) - total
    s.rate("c0", s.p("ki") * (s["gain"] * s["error"] + excess))
    return total


@effect(
    "drive.corrector",
    "pi",
    equation="drive",
    slot="corrector",
    source=_PID,
    shows=_FAST,
    numbers=(_KI,),
    states=(_C0,),
)
def pi(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + c0, c0' = ki (Kp e + sat(u) - u): the integral winds back as fast as it winds up."""
    return _integral(demand, s)


@effect(
    "drive.corrector",
    "lead",
    equation="drive",
    slot="corrector",
    source=_PID,
    shows=_FAST,
    numbers=(_TD, _TF),
    states=(_C1,),
)
def lead(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + Kp Td (e - c1)/tf, tf c1' = e - c1."""
    return _lead(demand, s, "error")


@effect(
    "drive.corrector",
    "pi-lead",
    equation="drive",
    slot="corrector",
    source=_PID,
    shows=_FAST,
    numbers=(_KI, _TD, _TF),
    states=(_C0, _C1),
)
def pi_lead(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + Kp Td (e - c1)/tf + c0, tf c1' = e - c1, c0' = ki (Kp e + sat(u) - u)."""
    return _integral(_lead(demand, s, "error"), s)


@effect(
    "drive.corrector",
    "lead on the spool",
    equation="drive",
    slot="corrector",
    source=_ON_SPOOL,
    shows=_FAST,
    numbers=(_TD, _TF),
    states=(_C1,),
)
def lead_on_spool(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand - Kp Td (z - c1)/tf, tf c1' = z - c1, z the measured spool over its travel."""
    return _lead(demand, s, "spool", -1)


@effect(
    "drive.corrector",
    "pi, lead on the spool",
    equation="drive",
    slot="corrector",
    source=_ON_SPOOL,
    shows=_FAST,
    numbers=(_KI, _TD, _TF),
    states=(_C0, _C1),
)
def pi_lead_on_spool(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand - Kp Td (z - c1)/tf + c0, tf c1' = z - c1, c0' = ki (Kp e + sat(u) - u)."""
    return _integral(_lead(demand, s, "spool", -1), s)


@effect(
    "drive.corrector",
    "first order",
    equation="drive",
    slot="corrector",
    source="Franklin, Powell, Emami-Naeini, Feedback Control of Dynamic Systems, 6th ed. 2010, ch. 6: lead and lag",
    shows=_FAST,
    numbers=(
        number("low", 0.5, "1", low=-0.5, high=30.0, off=0.0, meaning="gain at low frequency, less 1"),
        number("high", 0.5, "1", low=-0.5, high=10.0, off=0.0, meaning="gain at high frequency, less 1"),
        number(
            "T", 5e-3, "s", shown="ms", low=2e-4, high=0.5, meaning="time constant between them", tried=(5e-4, 5e-2)
        ),
    ),
    states=(_C1,),
)
def lead_or_lag(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + low Kp c1 + high (demand - Kp c1), T c1' = e - c1: (1 + low + (1 + high) T s)/(1 + T s)."""
    slow = s["gain"] * s.x("c1")
    s.rate("c1", (s["error"] - s.x("c1")) / s.p("T"))
    return demand + s.p("low") * slow + s.p("high") * (demand - slow)
