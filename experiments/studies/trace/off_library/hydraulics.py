"""Supply, oil and leaks otherwise than in the library."""

import casadi as ca

from workbench.plant.effects import EffectNumber, EffectState, Scope
from workbench.plant.orifice import root

from .formula import off_library, shape, size

_Pair = tuple[ca.SX, ca.SX]
_ATMOSPHERE = 1.013e5  # Pa
_LOWEST = 2e4  # Pa


def _sagged(supply: ca.SX, s: Scope) -> ca.SX:
    return supply - s.x("drop")


def _both_laws(_: None, s: Scope) -> None:
    """tau drop' = R Q + k Q^2 - drop: a line that is neither laminar nor turbulent."""
    flow = s["flow"]
    s.rate("drop", ((s.p("R") + s.p("k") * flow) * flow - s.x("drop")) / s.p("tau"))


def _inert_line(_: None, s: Scope) -> None:
    """tau^2 drop'' + 2 zeta tau drop' + drop = R Q: the oil of the line has inertia."""
    s.rate("drop", s.x("rate") / s.p("tau"))
    s.rate("rate", (s.p("R") * s["flow"] - s.x("drop") - 2 * s.p("zeta") * s.x("rate")) / s.p("tau"))


def _giving_way(_: None, s: Scope) -> None:
    """tau drop' = (P + drop) r^8/(1 + r^8) - drop, r = Q/(share Qr): a pump whose pressure gives way about its end."""
    ratio = (s["flow"] / s["rated"] / s.p("share")) ** 8
    s.rate("drop", ((s["supply"] + s.x("drop")) * ratio / (1 + ratio) - s.x("drop")) / s.p("tau"))


def _rounded_relief(leaks: _Pair, s: Scope) -> _Pair:
    """Q = G [f(pA - pB) - f(pB - pA)], f(p) = pw log(1 + exp((p - p0)/pw)): a valve that opens gradually."""
    drop, width = s["pa"] - s["pb"], s.p("pw")
    ahead, back = ((sign * drop - s.p("p0")) / width for sign in (1, -1))
    flow = s.p("G") * width * (ca.log1p(ca.exp(ca.fmin(ahead, 50))) - ca.log1p(ca.exp(ca.fmin(back, 50))))
    return leaks[0] + flow, leaks[1] - flow


def _exponential(modulus: ca.SX, s: Scope) -> ca.SX:
    """K = beta [1 - a exp(-p/p1)]."""
    return modulus * (1 - s.p("a") * ca.exp(-ca.fmax(s["pressure"], 0) / s.p("p1")))


def _logarithmic(modulus: ca.SX, s: Scope) -> ca.SX:
    """K = beta [1 + a log10((90 p/p1 + 3)/93)/2], p1 = 280 bar: falls towards low pressure, beta at p1."""
    return modulus * (1 + s.p("a") * ca.log10((90 * ca.fmax(s["pressure"], 0) / 2.8e7 + 3) / 93) / 2)


def _dissolving(modulus: ca.SX, s: Scope) -> ca.SX:
    """1/K = 1/beta + alpha (1 - p/ps)^2 p0/p^2 below ps: air goes into solution, all of it at ps; isothermal."""
    p = ca.fmax(s["pressure"], _LOWEST)
    free = ca.fmax(1 - p / s.p("ps"), 0)
    return modulus / (1 + modulus * s.p("alpha") * free * free * _ATMOSPHERE / (p * p))


def _heats(_: None, s: Scope) -> None:
    """tau warmth' = sqrt(Q/Qr) - warmth, rounded below 0.1 %."""
    s.rate("warmth", (ca.sqrt(s["flow"] / s["rated"] + 1e-6) - 1e-3 - s.x("warmth")) / s.p("tau"))


def _thins(force: ca.SX, s: Scope) -> ca.SX:
    """F + b v [exp(-k warmth) - 1]."""
    return force + s["viscous"] * s["velocity"] * (ca.exp(-s.p("k") * s.x("warmth")) - 1)


def _leaks_more(leaks: _Pair, s: Scope) -> _Pair:
    """QA + Q, QB - Q, Q = [exp(k warmth) - 1] Cl (pA - pB)."""
    more = (ca.exp(s.p("k") * s.x("warmth")) - 1) * s["internal"] * (s["pa"] - s["pb"])
    return leaks[0] + more, leaks[1] - more


def _flows_more(flows: _Pair, s: Scope) -> _Pair:
    """QA and QB times exp(k/10 warmth)."""
    factor = ca.exp(0.1 * s.p("k") * s.x("warmth"))
    return flows[0] * factor, flows[1] * factor


def _mixed(leaks: _Pair, s: Scope) -> _Pair:
    """QA = C (pA - pr) + k q(pA - pr), from chamber A alone, q the plant's signed root."""
    drop = s["pa"] - s["drain"]
    return leaks[0] + s.p("C") * drop + s.p("k") * root(drop), leaks[1]


def _opening_seal(leaks: _Pair, s: Scope) -> _Pair:
    """QB = C (pB - pr)^3/p1^2: a seal that pressure lifts."""
    drop = s["pb"] - s["drain"]
    return leaks[0], leaks[1] + s.p("C") * drop * drop * drop / s.p("p1") ** 2


def _at_the_end(ports: _Pair, s: Scope) -> _Pair:
    """PA, PB: what the valve sees of a line."""
    return _at(ports[0], "PA", s), _at(ports[1], "PB", s)


def _at(value: ca.SX, state: str, s: Scope) -> ca.SX:
    """The state of the line in place of a value, where there is a line."""
    return ca.if_else(s.p("r") > 0, s.x(state), value)


def _mixed_losses(flows: _Pair, s: Scope) -> _Pair:
    """A line with laminar and square losses at once, c w0 q + C w0^2 Ps (q/Qr)|q/Qr|/20."""
    w0, capacity = 2 * ca.pi * s.p("f"), ca.fmax(s.p("r"), 1e-2) * s["volume"] / s["beta"]
    for side, far, flow, sign in (("A", s["pa"], flows[0], 1), ("B", s["pb"], flows[1], -1)):
        q, near = s.x(f"q{side}"), s.x(f"P{side}")
        square = s["feed"] * q * ca.fabs(q) / s["rated"] ** 2 / 20
        s.rate(f"P{side}", sign * (flow - q) / capacity)
        s.rate(f"q{side}", capacity * w0 * w0 * (sign * (near - far) - square) - s.p("c") * w0 * q)
    return _at(flows[0], "qA", s), _at(flows[1], "qB", s)


_DROP = EffectState("drop", "Pa", 1e6)
_R = size("R", "Pa s/m^3", 1e8, 1e10, "resistance of the line")
_ALPHA = size("alpha", "1", 0.02, 0.3, "share of air in the volume at 1 atm")

EFFECTS = (
    off_library(
        "supply.sag",
        "linear and square",
        "Idelchik, Handbook of Hydraulic Resistance: laminar and local losses in series",
        {"supply": _sagged, "supply_flow": _both_laws},
        (_R, size("k", "Pa s^2/m^6", 1e10, 1e13, "square loss"), shape("tau", "s", 5e-3, "of line and manifold")),
        (_DROP,),
    ),
    off_library(
        "supply.sag",
        "inert line",
        "Watton, Fundamentals of Fluid Power Control, Cambridge 2009, ch. 5: resistance, inertance, capacitance",
        {"supply": _sagged, "supply_flow": _inert_line},
        (
            _R,
            shape("tau", "s", 5e-3, "1/(2 pi) of its period"),
            EffectNumber("zeta", "1", "1", 0.4, 0.2, 1.0, "damping"),
        ),
        (_DROP, EffectState("rate", "Pa", 1e6)),
    ),
    off_library(
        "supply.limit",
        "gives way",
        "Ivantysyn, Ivantysynova, Hydrostatic Pumps and Motors, Akademia Books 2001: pressure compensator",
        {"supply": _sagged, "supply_flow": _giving_way},
        (
            size("share", "1", 0.05, 1.0, "flow over rated flow at half the pressure"),
            shape("tau", "s", 5e-3, "of the line"),
        ),
        (_DROP,),
    ),
    off_library(
        "jack.crossport_relief",
        "gradual",
        "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 9: relief valve, its override",
        {"leakage": _rounded_relief},
        (
            size("G", "m^3/s/Pa", 1e-10, 1e-8, "flow per pressure"),
            shape("p0", "Pa", 5e6, "pressure that half opens it"),
            shape("pw", "Pa", 5e5, "pressure over which it opens"),
        ),
    ),
    off_library(
        "line.hose",
        "both losses",
        "Idelchik, Handbook of Hydraulic Resistance: laminar and local losses in series",
        {"line_flows": _mixed_losses, "ports": _at_the_end},
        (
            size("r", "1", 0.2, 2.0, "volume of a line over a chamber's"),
            shape("f", "Hz", 120.0, "resonance of a line"),
            shape("c", "1", 0.2, "laminar damping"),
        ),
        (
            EffectState("PA", "Pa", 1e7, follows="P1"),
            EffectState("PB", "Pa", 1e7, follows="P2"),
            EffectState("qA", "m^3/s", 1e-3),
            EffectState("qB", "m^3/s", 1e-3),
        ),
    ),
    off_library(
        "oil.warming",
        "exponential",
        "Reynolds, Phil. Trans. 177, 1886: viscosity falls exponentially with temperature",
        {"supply_flow": _heats, "friction": _thins, "leakage": _leaks_more, "line_flows": _flows_more},
        (
            size("k", "1", 5.0, 20.0, "logarithm of viscosity over that where warmth is 1"),
            shape("tau", "s", 5.0, "time constant"),
        ),
        (EffectState("warmth", "1", 1.0),),
    ),
    off_library(
        "oil.air",
        "exponential",
        "Hoffmann, Dynamisches Verhalten hydraulischer Steuerungssysteme, Springer 1981",
        {"modulus": _exponential},
        (
            size("a", "1", 0.3, 0.95, "share of the modulus that is missing at no pressure"),
            shape("p1", "Pa", 5e6, "pressure over which it comes"),
        ),
    ),
    off_library(
        "oil.air",
        "logarithmic",
        "Boes, Christian: Hydraulische Achsantriebe im digitalen Regelkreis, RWTH Aachen 1995",
        {"modulus": _logarithmic},
        (size("a", "1", 0.5, 1.2, "1: as published"),),
    ),
    off_library(
        "oil.air",
        "dissolving",
        "Zhou, Vacca, Manhartsgruber, J. Fluids Engineering 135(9), 2013: gas that goes into solution, simplified",
        {"modulus": _dissolving},
        (_ALPHA, shape("ps", "Pa", 1.5e7, "pressure at which all is dissolved")),
    ),
    off_library(
        "jack.external_leakage",
        "mixed, one side",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 3.2 and 3.3",
        {"leakage": _mixed},
        (size("C", "m^3/s/Pa", 1e-11, 1e-9, "laminar leak"), size("k", "m^3/s/Pa^0.5", 3e-8, 3e-6, "turbulent leak")),
    ),
    off_library(
        "jack.external_leakage",
        "seal that opens",
        "flow in a gap grows with the cube of its height",
        {"leakage": _opening_seal},
        (size("C", "m^3/s/Pa", 2e-11, 2e-9, "leak at p1"), shape("p1", "Pa", 1e7, "pressure")),
    ),
)
