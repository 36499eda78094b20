"""jack.crossport_relief: relief valves from chamber to chamber open beyond a pressure difference. Flows [m^3/s]."""

from collections.abc import Callable
from functools import partial

import casadi as ca

from ...orifice import root
from ..decorator import effect, number
from ..effect import Scope

_Pair = tuple[ca.SX, ca.SX]

_P0 = number(
    "p0",
    8e6,
    "Pa",
    shown="bar",
    low=2e5,
    high=1e8,
    meaning="pressure difference that opens it",
    tried=(1e6, 3e6, 1.6e7),
)
_relief = partial(
    effect,
    "jack.crossport_relief",
    equation="flow",
    slot="leakage",
    shows="hard starts and stops, and pushing against a stop, with both pressures recorded",
)


def _relieved(leaks: _Pair, s: Scope, law: Callable[[ca.SX], ca.SX]) -> _Pair:
    """The leaks with law(pressure beyond the opening one) [m^3/s] from the chamber of more pressure to the other."""
    drop = s["pa"] - s["pb"]
    flow = law(ca.fmax(drop - s.p("p0"), 0)) - law(ca.fmax(-drop - s.p("p0"), 0))
    return leaks[0] + flow, leaks[1] - flow


@_relief(
    "linear",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 9: relief valve beyond its cracking pressure",
    numbers=(
        number("G", 1e-9, "m^3/s/Pa", shown="l/min/bar", low=0.0, high=1e-6, off=0.0, meaning="flow per pressure"),
        _P0,
    ),
)
def linear(leaks: _Pair, s: Scope) -> _Pair:
    """QA + Q, QB - Q, Q = G [max(pA - pB - p0, 0) - max(pB - pA - p0, 0)]."""
    return _relieved(leaks, s, lambda beyond: s.p("G") * beyond)


@_relief(
    "orifice",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3: turbulent orifice, open beyond a pressure",
    numbers=(
        number("k", 2e-7, "m^3/s/Pa^0.5", shown="l/min/bar^0.5", low=0.0, high=1e-4, off=0.0, meaning="flow per root"),
        _P0,
    ),
)
def orifice(leaks: _Pair, s: Scope) -> _Pair:
    """QA + Q, QB - Q, Q = k [q(max(pA - pB - p0, 0)) - q(max(pB - pA - p0, 0))], q the plant's signed root."""
    return _relieved(leaks, s, lambda beyond: s.p("k") * root(beyond))
