"""Drive effects, between the command and the pilot current: timing, a current limit, a corrector nobody declared."""

import casadi as ca

from .effect import Effect, EffectNumber, EffectState, Scope
from .lag import first_order

_TIMING = "drive timing"
_FAST = "steps and fast multisine on the command, with current or spool recorded"
_LARGE = "large steps of the command, with current recorded"
_MERRITT = "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6: torque motor driven through its coil"
_FILTER = "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 5: first-order prefilter"
_PID = "Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3: filtered derivative, back-calculation with Tt = Ti"


def _amplifier(current: ca.SX, s: Scope) -> ca.SX:
    """tau i' = demand - i: the current lags its demand."""
    return first_order(current, s, "i")


def _command_filter(command: ca.SX, s: Scope) -> ca.SX:
    """tau c' = command - c: the drive filters its command."""
    return first_order(command, s, "c")


def _hard(current: ca.SX, s: Scope) -> ca.SX:
    """|i| <= share * declared limit."""
    top = s.p("share") * s["limit"]
    return ca.fmax(ca.fmin(current, top), -top)


def _soft(current: ca.SX, s: Scope) -> ca.SX:
    """i = demand / sqrt(1 + (w demand / declared limit)^2): it tends to limit/w; w = 0 leaves the demand as it is."""
    ratio = s.p("w") * current / s["limit"]
    return current / ca.sqrt(1 + ratio * ratio)


def _lead(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + Kp Td (e - c1)/tf, tf c1' = e - c1."""
    rate = (s["error"] - s.x("c1")) / s.p("tf")
    s.rate("c1", rate)
    return demand + s["gain"] * s.p("Td") * rate


def _integral(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + c0, c0' = ki (Kp e + sat(u) - u): the integral winds back as fast as it winds up."""
    total = demand + s.x("c0")
    excess = ca.fmax(ca.fmin(total, s["limit"]), -s["limit"]) - total
    s.rate("c0", s.p("ki") * (s["gain"] * s["error"] + excess))
    return total


def _pi_lead(demand: ca.SX, s: Scope) -> ca.SX:
    """u = demand + Kp Td (e - c1)/tf + c0, tf c1' = e - c1, c0' = ki (Kp e + sat(u) - u)."""
    return _integral(_lead(demand, s), s)


_TAU = EffectNumber("tau", "s", "ms", 1e-3, 0.0, 2e-2, "time constant", off=0.0)
_KI = EffectNumber("ki", "1/s", "1/s", 40.0, 0.0, 500.0, "integral rate 1/Ti", off=0.0)
_TD = EffectNumber("Td", "s", "ms", 5e-4, 0.0, 3e-3, "lead time", off=0.0)
_TF = EffectNumber("tf", "s", "ms", 5e-4, 1e-4, 5e-3, "filter of the lead")
_C0, _C1 = EffectState("c0", "1", 1.0), EffectState("c1", "1", 1.0)


def _corrector(formula: str, numbers: tuple[EffectNumber, ...], states: tuple[EffectState, ...]) -> Effect:
    law = {"pi": _integral, "lead": _lead, "pi-lead": _pi_lead}[formula]
    return Effect("drive.corrector", formula, "drive", _PID, _FAST, {"corrector": law}, numbers, states)


EFFECTS = (
    Effect(
        "drive.delay",
        "shift",
        "drive",
        "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 4: transport delay",
        _FAST,
        {},
        (EffectNumber("delay", "s", "ms", 2e-3, 0.0, 2e-2, "time by which the command is late", off=0.0),),
        family=_TIMING,
        delay="delay",
    ),
    Effect(
        "drive.lag",
        "amplifier",
        "drive",
        _MERRITT,
        _FAST,
        {"current": _amplifier},
        (_TAU,),
        (EffectState("i", "A", 0.02),),
        family=_TIMING,
    ),
    Effect(
        "drive.lag",
        "command filter",
        "drive",
        _FILTER,
        _FAST,
        {"command": _command_filter},
        (_TAU,),
        (EffectState("c", "1", 1.0),),
        family=_TIMING,
    ),
    Effect(
        "drive.saturation",
        "hard",
        "drive",
        "Astrom, Hagglund, Advanced PID Control, ISA 2006, ch. 3: actuator saturation",
        _LARGE,
        {"current": _hard},
        (EffectNumber("share", "1", "%", 0.15, 0.02, 1.0, "current limit over the declared one", off=1.0),),
    ),
    Effect(
        "drive.saturation",
        "soft",
        "drive",
        "Rapp, 2nd European Conference on Satellite Communications, 1991: amplifier that saturates smoothly, p = 1",
        _LARGE,
        {"current": _soft},
        (EffectNumber("w", "1", "1", 5.0, 0.0, 50.0, "declared limit over the current that is tended to", off=0.0),),
    ),
    _corrector("pi", (_KI,), (_C0,)),
    _corrector("lead", (_TD, _TF), (_C1,)),
    _corrector("pi-lead", (_KI, _TD, _TF), (_C0, _C1)),
)
