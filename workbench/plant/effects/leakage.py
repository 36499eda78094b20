"""jack.external_leakage: leaks from the chambers to the drain, past rod seals or through fittings. Flows [m^3/s]."""

import casadi as ca

from ..orifice import root
from .effect import Effect, EffectNumber, Scope

_Pair = tuple[ca.SX, ca.SX]


def _laminar(leaks: _Pair, s: Scope) -> _Pair:
    """QA = CA (pA - pr), QB = CB (pB - pr)."""
    from_a, from_b = leaks
    return from_a + s.p("CA") * (s["pa"] - s["drain"]), from_b + s.p("CB") * (s["pb"] - s["drain"])


def _orifice(leaks: _Pair, s: Scope) -> _Pair:
    """QA = kA q(pA - pr), QB = kB q(pB - pr), q the plant's signed root."""
    from_a, from_b = leaks
    return from_a + s.p("kA") * root(s["pa"] - s["drain"]), from_b + s.p("kB") * root(s["pb"] - s["drain"])


_SHOWS = "standing still under load, and slow moves, with both pressures recorded"


def _number(name: str, si: str, shown: str, typical: float, high: float) -> EffectNumber:
    return EffectNumber(name, si, shown, typical, 0.0, high, f"leak from chamber {name[-1]}", off=0.0)


EFFECTS = (
    Effect(
        "jack.external_leakage",
        "laminar",
        "flow",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 6.1: external leakage of a piston",
        _SHOWS,
        {"leakage": _laminar},
        (
            _number("CA", "m^3/s/Pa", "l/min/bar", 2e-11, 1e-9),
            _number("CB", "m^3/s/Pa", "l/min/bar", 5e-12, 1e-9),
        ),
    ),
    Effect(
        "jack.external_leakage",
        "orifice",
        "flow",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 3.3: turbulent orifice",
        _SHOWS,
        {"leakage": _orifice},
        (
            _number("kA", "m^3/s/Pa^0.5", "l/min/bar^0.5", 6e-8, 3e-6),
            _number("kB", "m^3/s/Pa^0.5", "l/min/bar^0.5", 1.5e-8, 3e-6),
        ),
    ),
)
