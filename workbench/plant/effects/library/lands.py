"""main.deadband and main.asymmetry: lands of the main spool that do not meet their ports as declared."""

import casadi as ca

from ...orifice import exponential_lap
from ..decorator import effect, number
from ..effect import EffectNumber, Scope

_Pair = tuple[ca.SX, ca.SX]

_ALIVE = 0.01  # of the travel acts inside a dead zone: without any, nothing there leads to an equilibrium outside it
_SUDDEN = 2e-3  # of full command, over which a drive jumps
_NULL = "slow triangles and small steps of the command through null, with spool recorded"
_BOTH_WAYS = "steady moves in both directions at several openings, with spool and position recorded"
_MERRITT = "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5: flow gain of a valve, with gains of its own a side"
_LAP = "lap of Salazar Garcia et al., ICINCO 2007, shifted; leak of Eryilmaz, Wilson, J. Franklin Inst. 343, 2006"
_DEAD_ZONE = "Tao, Kokotovic, IEEE Trans. Automatic Control 39(1), 1994: dead zone"

_OVERLAP = number(
    "overlap",
    0.02,
    "1",
    shown="%",
    low=0.0,
    high=0.6,
    off=0.0,
    meaning="overlap of the lands over full travel",
    tried=(0.1, 0.3),  # as mobile valves have it
)
_A = number(
    "a",
    0.1,
    "1",
    shown="%",
    low=-0.6,
    high=0.6,
    off=0.0,
    meaning="excess of one side, shortfall of the other",
)


def _shifted(s: Scope) -> _Pair:
    eps, overlap = s["lap"], s.p("overlap") * s["travel"]
    clearance = eps * eps / (eps + overlap) - eps * ca.exp(-overlap / eps)
    forward, backward = (exponential_lap(z - overlap, eps) + clearance for z in (s["spool"], -s["spool"]))
    return forward, backward


@effect(
    "main.deadband",
    "lap",
    equation="flow",
    slot="main_openings",
    source=_LAP,
    shows=_NULL,
    numbers=(_OVERLAP,),
)
def shifted_lap(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(z - d) + c, d = overlap * travel, lap the plant's own, c = eps^2/(eps + d) - eps exp(-d/eps).

    c keeps the leak at null at that of a clearance as long as the overlap, eps^2/(eps + d).
    """
    return _shifted(s)


def _laps(z: ca.SX, s: Scope) -> _Pair:
    return exponential_lap(z, s["lap"]), exponential_lap(-z, s["lap"])


@effect(
    "main.deadband",
    "linear",
    equation="flow",
    slot="main_openings",
    source=_DEAD_ZONE,
    shows=_NULL,
    numbers=(_OVERLAP,),
)
def dead_zone(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(z - 0.99 sat(z, d)), d = overlap * travel: within +-d the lands leak nearly as they do at null."""
    return _dead_zone(s)


def _dead_zone(s: Scope) -> _Pair:
    z, overlap = s["spool"], s.p("overlap") * s["travel"]
    return _laps(z - (1 - _ALIVE) * ca.fmax(ca.fmin(z, overlap), -overlap), s)


def _softplus(x: ca.SX, width: ca.SX) -> ca.SX:
    """width log(1 + exp(x/width)), which does not overflow."""
    return ca.fmax(x, 0) + width * ca.log(1 + ca.exp(-ca.fabs(x) / width))


@effect(
    "main.deadband",
    "smooth",
    equation="flow",
    slot="main_openings",
    source=f"{_DEAD_ZONE}, its corners rounded by softplus",
    shows=_NULL,
    numbers=(
        _OVERLAP,
        number("width", 2e-3, "1", shown="%", low=2e-4, high=0.05, meaning="rounding of the corners over full travel"),
    ),
)
def smooth_dead_zone(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(sp(z - d) - sp(-z - d)), sp(x) = w log(1 + exp(x/w)), d = overlap * travel, w = width * travel.

    At d = 0 this is lap(z), whatever w.
    """
    z, overlap, width = s["spool"], s.p("overlap") * s["travel"], s.p("width") * s["travel"]
    return _laps(_softplus(z - overlap, width) - _softplus(-z - overlap, width), s)


def _jump(command: ca.SX, s: Scope) -> ca.SX:
    """u + jump tanh(u/0.002)."""
    return command + s.p("jump") * ca.tanh(command / _SUDDEN)


@effect(
    "main.deadband",
    "linear, with jump",
    equation="flow",
    slot="main_openings",
    also={"command": _jump},
    source=f"{_DEAD_ZONE}: its inverse in the drive",
    shows=_NULL,
    numbers=(
        _OVERLAP,
        number("jump", 0.01, "1", shown="%", low=0.0, high=0.6, off=0.0, meaning="what the drive adds to its command"),
    ),
)
def compensated_dead_zone(_: _Pair, s: Scope) -> _Pair:
    """The openings of the formula "linear", behind a drive that jumps over the dead band: u + jump tanh(u/0.002)."""
    return _dead_zone(s)


@effect(
    "main.deadband",
    "lap, narrow passages",
    equation="flow",
    slot="main_openings",
    source=f"{_LAP}; orifices in series: Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3",
    shows=f"{_NULL}, and steady moves at three openings or more",
    numbers=(
        _OVERLAP,
        number(
            "c",
            1.0,
            "1",
            low=0.0,
            high=10.0,
            off=0.0,
            meaning="(area of a land at full travel over that of its passages)^2; at 1 they are as wide",
            given=True,
        ),
    ),
)
def narrow_passages(_: _Pair, s: Scope) -> _Pair:
    """o/sqrt(1 + c (o/travel)^2), o the openings of the formula "lap".

    A land and the passages from it to the port are two orifices in series: 1/A^2 = 1/A1^2 + 1/A2^2.
    """
    forward, backward = (opening / ca.sqrt(1 + s.p("c") * (opening / s["travel"]) ** 2) for opening in _shifted(s))
    return forward, backward


@effect(
    "main.asymmetry",
    "direction",
    equation="flow",
    slot="main_openings",
    source=_MERRITT,
    shows=_BOTH_WAYS,
    numbers=(_A,),
)
def direction(openings: _Pair, s: Scope) -> _Pair:
    """o(z) (1 + a) for the lands that extend, o(-z) (1 - a) for those that retract."""
    extend, retract = openings
    return extend * (1 + s.p("a")), retract * (1 - s.p("a"))


@effect(
    "main.asymmetry",
    "lands",
    equation="flow",
    slot="main_flows",
    source=_MERRITT,
    shows=f"{_BOTH_WAYS}, and both pressures",
    numbers=(_A,),
)
def unequal_lands(flows: _Pair, s: Scope) -> _Pair:
    """QA (1 + a) through the lands of port A, QB (1 - a) through those of port B."""
    into_a, out_of_b = flows
    return into_a * (1 + s.p("a")), out_of_b * (1 - s.p("a"))


def _edge(name: str, typical: float, path: str) -> EffectNumber:
    meaning = f"extra flow from {path}, over that from supply to A"
    return number(name, typical, "1", shown="%", low=-0.6, high=0.6, off=0.0, meaning=meaning)


@effect(
    "main.asymmetry",
    "edges",
    equation="flow",
    slot="main_flows",
    source=_MERRITT,
    shows=f"{_BOTH_WAYS}, and both pressures",
    numbers=(
        _edge("b_return", 0.05, "B to return"),
        _edge("p_b", -0.1, "supply to B"),
        _edge("a_return", 0.05, "A to return"),
    ),
)
def four_edges(flows: _Pair, s: Scope) -> _Pair:
    """QA (1 + a_return) where A empties, QB (1 + b_return) where B empties and QB (1 + p_b) where it fills."""
    into_a, out_of_b = flows
    return (
        into_a * ca.if_else(into_a > 0, 1, 1 + s.p("a_return")),
        out_of_b * ca.if_else(out_of_b > 0, 1 + s.p("b_return"), 1 + s.p("p_b")),
    )


def _bend(name: str, typical: float, way: str) -> EffectNumber:
    return number(name, typical, "1", shown="%", low=-0.6, high=0.6, off=0.0, meaning=f"extra gain near null, {way}")


@effect(
    "main.asymmetry",
    "curve",
    equation="flow",
    slot="main_openings",
    source=_MERRITT,
    shows=_BOTH_WAYS,
    numbers=(_bend("c_extend", 0.2, "extending"), _bend("c_retract", -0.2, "retracting")),
)
def curve(openings: _Pair, s: Scope) -> _Pair:
    """o [1 + c (1 - o/travel)], with one c for the lands that extend and one for those that retract.

    The flow at full travel stays, the gain at null is 1 + c of the declared one.
    """

    def bent(opening: ca.SX, bend: ca.SX) -> ca.SX:
        return opening * (1 + bend * (1 - opening / s["travel"]))

    return bent(openings[0], s.p("c_extend")), bent(openings[1], s.p("c_retract"))
