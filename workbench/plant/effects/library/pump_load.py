"""Effects of what a pump drive moves, and of what measures it: load, jack, pressure signals.

They are sought on such rigs alone; see `kinds` of an effect.
"""

from functools import partial

import casadi as ca

from ...orifice import root
from ..decorator import effect, number, state
from ..effect import Scope

_Pair = tuple[ca.SX, ca.SX]
_MERRITT = "Merritt, Hydraulic Control Systems, Wiley 1967"
_KINDS = ("pump",)
_LOAD = "no records with such a load, which was met on a pump with direction valves alone"
_EDGE = 5e-5  # m, over which a load stops building up

_SHARE = number("share", 1.0, "1", shown="%", low=0.0, high=1.0, off=0.0, meaning="of the push that builds up")
_K = number("k", 2e6, "N/m", shown="kN/mm", low=1e4, high=1e9, meaning="stiffness of the oil that it presses together")
_DRAG = number("drag", 300.0, "N", shown="kN", low=0.0, high=1e4, meaning="push that its valve and line have unset")
_GAP = number("gap", 1e-3, "m", shown="mm", low=0.0, high=0.1, meaning="travel before it pushes")
_TAU = number("tau", 20.0, "s", low=0.1, high=1e4, meaning="time in which it lets go, standing")

_buildup = partial(
    effect,
    "load.buildup",
    equation="force",
    slot="loader",
    shows="starts and stops at several settings of the load, with both pressures and position recorded",
    states=(state("s", "m", 5e-3),),
    kinds=_KINDS,
    elsewhere=_LOAD,
)
_throttle = partial(
    effect,
    "load.throttle",
    equation="force",
    slot="body_force",
    shows="the same stroke at several speeds without load, with both pressures recorded",
    kinds=_KINDS,
    elsewhere=_LOAD,
)
_internal = partial(
    effect,
    "jack.internal_leakage",
    equation="flow",
    slot="leakage",
    shows="standing under load with the valves shut, with both pressures recorded",
    kinds=_KINDS,
    elsewhere="the leakage between its chambers as a number of the rig, Cl",
)


def _pushed(force: ca.SX, s: Scope, gap: ca.SX | float, relaxing: ca.SX | float) -> ca.SX:
    """k times the travel s that it is pressed together, between -gap and where the push is the set one."""
    travel, k, v = s.x("s"), s.p("k"), s["velocity"]
    over = s["full"] - s.p("drag")
    limit = (s.p("drag") + (over + ca.sqrt(over * over + 1e4)) / 2) / k
    onward = ca.fmax(v, 0) * ca.tanh((limit - travel) / _EDGE)
    back = ca.fmin(v, 0) * ca.tanh((travel + gap) / _EDGE)
    s.rate("s", onward + back - relaxing * ca.fmax(travel, 0))
    return force + s.p("share") * (k * ca.fmax(travel, 0) - force)


@_buildup(
    "slip",
    source="Iwan, A distributed-element model for hysteresis, J. Appl. Mech. 33, 1966: spring and slip",
    numbers=(_SHARE, _K, _DRAG),
)
def slip(force: ca.SX, s: Scope) -> ca.SX:
    """F' = k v between 0 and the set push; unset it still pushes with `drag`."""
    return _pushed(force, s, 0.0, 0.0)


@_buildup(
    "gap and slip",
    source="Iwan, A distributed-element model for hysteresis, J. Appl. Mech. 33, 1966: with a gap before the spring",
    numbers=(_SHARE, _K, _DRAG, _GAP),
)
def gap_and_slip(force: ca.SX, s: Scope) -> ca.SX:
    """Slip after a travel `gap` from where it let go."""
    return _pushed(force, s, s.p("gap"), 0.0)


@_buildup(
    "slip and leak",
    source=f"{_MERRITT}, ch. 6: a chamber with a relief valve and a leak",
    numbers=(_SHARE, _K, _DRAG, _TAU),
)
def slip_and_leak(force: ca.SX, s: Scope) -> ca.SX:
    """F' = k v - F/tau between 0 and the set push: its chamber leaks."""
    return _pushed(force, s, 0.0, 1 / s.p("tau"))


@_throttle(
    "laminar",
    source=f"{_MERRITT}, ch. 3: laminar line of the cylinder that it drags along",
    numbers=(number("c", 2e4, "N s/m", shown="kN s/m", low=0.0, high=1e6, off=0.0, meaning="force per speed"),),
)
def laminar_throttle(force: ca.SX, s: Scope) -> ca.SX:
    """F = c v."""
    return force + s.p("c") * s["velocity"]


@_throttle(
    "orifice",
    source=f"{_MERRITT}, ch. 3: turbulent orifice",
    numbers=(number("d", 1e6, "N s^2/m^2", low=0.0, high=1e9, off=0.0, meaning="force per square of the speed"),),
)
def orifice_throttle(force: ca.SX, s: Scope) -> ca.SX:
    """F = d v |v|."""
    v = s["velocity"]
    return force + s.p("d") * v * ca.sqrt(v * v + 1e-10)


@_internal(
    "laminar",
    source=f"{_MERRITT}, ch. 6: cross-port leakage of a piston",
    numbers=(
        number("C", 1e-13, "m^3/s/Pa", shown="l/min/bar", low=0.0, high=1e-10, off=0.0, meaning="leak past the piston"),
    ),
)
def laminar_internal(leaks: _Pair, s: Scope) -> _Pair:
    """Q = C (pA - pB), out of A and into B."""
    across = s.p("C") * (s["pa"] - s["pb"])
    return leaks[0] + across, leaks[1] - across


@_internal(
    "orifice",
    source=f"{_MERRITT}, ch. 3: turbulent orifice, as of a damaged seal",
    numbers=(
        number("k", 1e-10, "m^3/s/Pa^0.5", shown="l/min/bar^0.5", low=0.0, high=1e-7, off=0.0, meaning="leak per root"),
    ),
)
def orifice_internal(leaks: _Pair, s: Scope) -> _Pair:
    """Q = k q(pA - pB), q the plant's signed root."""
    across = s.p("k") * root(s["pa"] - s["pb"])
    return leaks[0] + across, leaks[1] - across


def _zero_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """pB + b."""
    return pressure + s.p("b")


@effect(
    "sensor.zero",
    "offset",
    equation="sensor",
    slot="sensor_pa",
    also={"sensor_pb": _zero_b},
    source="Doebelin, Measurement Systems, 5th ed., McGraw-Hill 2004, ch. 3: static calibration",
    shows="both chambers joined to the low side, or to the atmosphere",
    numbers=(
        # 1 % of 200 bar: what a transducer's zero point may be off by, and gauge taken for absolute
        number("a", 0.5e5, "Pa", shown="bar", low=-2e5, high=2e5, off=0.0, meaning="of the signal of A"),
        number("b", 0.5e5, "Pa", shown="bar", low=-2e5, high=2e5, off=0.0, meaning="of the signal of B"),
    ),
    kinds=_KINDS,
    elsewhere="no direction valves that join both chambers to the low side, which would show it",
)
def zero(pressure: ca.SX, s: Scope) -> ca.SX:
    """pA + a; pB + b: a zero point that is not that of the calibration."""
    return pressure + s.p("a")
