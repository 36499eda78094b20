"""main.deadband and main.asymmetry: lands of the main spool that do not meet their ports as declared."""

import casadi as ca

from ..orifice import exponential_lap
from .effect import Effect, EffectNumber, Scope

_Pair = tuple[ca.SX, ca.SX]
_ALIVE = 0.01  # of the travel acts inside a dead zone: without any, nothing there leads to an equilibrium outside it


def _shifted_lap(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(z - d) + c, d = overlap * travel, lap the plant's own, c = eps^2/(eps + d) - eps exp(-d/eps).

    c keeps the leak at null at that of a clearance as long as the overlap, eps^2/(eps + d).
    """
    eps, overlap = s["lap"], s.p("overlap") * s["travel"]
    clearance = eps * eps / (eps + overlap) - eps * ca.exp(-overlap / eps)
    forward, backward = (exponential_lap(z - overlap, eps) + clearance for z in (s["spool"], -s["spool"]))
    return forward, backward


def _laps(z: ca.SX, s: Scope) -> _Pair:
    return exponential_lap(z, s["lap"]), exponential_lap(-z, s["lap"])


def _dead_zone(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(z - 0.99 sat(z, d)), d = overlap * travel: within +-d the lands leak nearly as they do at null."""
    z, overlap = s["spool"], s.p("overlap") * s["travel"]
    return _laps(z - (1 - _ALIVE) * ca.fmax(ca.fmin(z, overlap), -overlap), s)


def _softplus(x: ca.SX, width: ca.SX) -> ca.SX:
    """width log(1 + exp(x/width)), which does not overflow."""
    return ca.fmax(x, 0) + width * ca.log(1 + ca.exp(-ca.fabs(x) / width))


def _smooth_dead_zone(_: _Pair, s: Scope) -> _Pair:
    """o(z) = lap(sp(z - d) - sp(-z - d)), sp(x) = w log(1 + exp(x/w)), d = overlap * travel, w = width * travel.

    At d = 0 this is lap(z), whatever w.
    """
    z, overlap, width = s["spool"], s.p("overlap") * s["travel"], s.p("width") * s["travel"]
    return _laps(_softplus(z - overlap, width) - _softplus(-z - overlap, width), s)


def _direction(openings: _Pair, s: Scope) -> _Pair:
    """o(z) (1 + a) for the lands that extend, o(-z) (1 - a) for those that retract."""
    forward, backward = openings
    return forward * (1 + s.p("a")), backward * (1 - s.p("a"))


def _unequal_lands(flows: _Pair, s: Scope) -> _Pair:
    """QA (1 + a) through the lands of port A, QB (1 - a) through those of port B."""
    into_a, out_of_b = flows
    return into_a * (1 + s.p("a")), out_of_b * (1 - s.p("a"))


def _curve(openings: _Pair, s: Scope) -> _Pair:
    """o [1 + c (1 - o/travel)], with one c for the lands that extend and one for those that retract.

    The flow at full travel stays, the gain at null is 1 + c of the declared one.
    """

    def bent(opening: ca.SX, bend: ca.SX) -> ca.SX:
        return opening * (1 + bend * (1 - opening / s["travel"]))

    return bent(openings[0], s.p("c_extend")), bent(openings[1], s.p("c_retract"))


_NULL = "slow triangles and small steps of the command through null, with spool recorded"
_BOTH_WAYS = "steady moves in both directions at several openings, with spool and position recorded"
_MERRITT = "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 5.6: flow gain of overlapped and ported valves"
_OVERLAP = EffectNumber("overlap", "1", "%", 0.02, 0.0, 0.3, "overlap of the lands over full travel", off=0.0)
_A = EffectNumber("a", "1", "%", 0.1, -0.6, 0.6, "how much more one side flows, how much less the other", off=0.0)


def _bend(way: str, typical: float) -> EffectNumber:
    return EffectNumber(
        f"c_{way}", "1", "%", typical, -0.6, 0.6, f"more gain near null than declared, {way}ing", off=0.0
    )


EFFECTS = (
    Effect(
        "main.deadband",
        "lap",
        "flow",
        "lap of Salazar Garcia et al., ICINCO 2007, shifted; leak of Eryilmaz, Wilson, J. Franklin Inst. 343, 2006",
        _NULL,
        {"main_openings": _shifted_lap},
        (_OVERLAP,),
    ),
    Effect(
        "main.deadband",
        "linear",
        "flow",
        "Tao, Kokotovic, IEEE Trans. Automatic Control 39(1), 1994: dead zone with unit slopes",
        _NULL,
        {"main_openings": _dead_zone},
        (_OVERLAP,),
    ),
    Effect(
        "main.deadband",
        "smooth",
        "flow",
        "Tao, Kokotovic, IEEE Trans. Automatic Control 39(1), 1994: dead zone, its corners rounded by softplus",
        _NULL,
        {"main_openings": _smooth_dead_zone},
        (_OVERLAP, EffectNumber("width", "1", "%", 2e-3, 2e-4, 0.05, "rounding of the corners over full travel")),
    ),
    Effect("main.asymmetry", "direction", "flow", _MERRITT, _BOTH_WAYS, {"main_openings": _direction}, (_A,)),
    Effect(
        "main.asymmetry",
        "lands",
        "flow",
        _MERRITT,
        f"{_BOTH_WAYS}, and both pressures",
        {"main_flows": _unequal_lands},
        (_A,),
    ),
    Effect(
        "main.asymmetry",
        "curve",
        "flow",
        _MERRITT,
        _BOTH_WAYS,
        {"main_openings": _curve},
        (_bend("extend", 0.2), _bend("retract", -0.2)),
    ),
)
