"""jack.external_leakage: leaks from the chambers to the drain, past rod seals or through fittings. Flows [m^3/s]."""

from functools import partial

import casadi as ca

from ...orifice import root
from ..decorator import effect, number
from ..effect import EffectNumber, Scope

_Pair = tuple[ca.SX, ca.SX]

_leak = partial(
    effect,
    "jack.external_leakage",
    equation="flow",
    slot="leakage",
    shows="standing still under load, and slow moves, with both pressures recorded",
)


def _number(name: str, typical: float, si: str, shown: str, high: float) -> EffectNumber:
    meaning = f"leak from chamber {name[-1]}"
    return number(name, typical, si, shown=shown, low=0.0, high=high, off=0.0, meaning=meaning)


@_leak(
    "laminar",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6: external leakage of a piston",
    numbers=(
        _number("CA", 5e-12, "m^3/s/Pa", "l/min/bar", 1e-9),
        _number("CB", 2e-12, "m^3/s/Pa", "l/min/bar", 1e-9),
    ),
)
def laminar(leaks: _Pair, s: Scope) -> _Pair:
    """QA = CA (pA - pr), QB = CB (pB - pr)."""
    from_a, from_b = leaks
    return from_a + s.p("CA") * (s["pa"] - s["drain"]), from_b + s.p("CB") * (s["pb"] - s["drain"])


@_leak(
    "orifice",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3: turbulent orifice",
    numbers=(
        _number("kA", 1.5e-8, "m^3/s/Pa^0.5", "l/min/bar^0.5", 3e-6),
        _number("kB", 6e-9, "m^3/s/Pa^0.5", "l/min/bar^0.5", 3e-6),
    ),
)
def orifice(leaks: _Pair, s: Scope) -> _Pair:
    """QA = kA q(pA - pr), QB = kB q(pB - pr), q the plant's signed root."""
    from_a, from_b = leaks
    return from_a + s.p("kA") * root(s["pa"] - s["drain"]), from_b + s.p("kB") * root(s["pb"] - s["drain"])
