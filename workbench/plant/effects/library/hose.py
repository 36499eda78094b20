"""line.hose: volume, inertance and resistance of two like lines between the valve and the chambers.

The valve, and whatever measures pA and pB, see the near ends PA and PB; qA flows into chamber A, qB out of B. With the
capacitance C = r V/beta of a line, r its volume over the chamber's mean one V at mid stroke, and w0 = 2 pi f,

    C PA' = QA - qA,  qA' = C w0^2 (PA - pA - dp(qA)),  C PB' = qB - QB,  qB' = C w0^2 (pB - PB - dp(qB))

above saturation; below, gas comes out of the oil as in a chamber (plant/oil.py) and goes along: of what flows, the
share of oil is that in the volume it leaves, so that a column that runs on empties none. A line below 1 % of V comes on
as 1 - exp(-1e6 r), so that one without volume is none; no air is in its oil. A pump drive, whose file has what its
hoses give, may declare lines between pump and jack; its trace seeks hose.compliance.

Where a rig file gives no r, lines have the next nominal bore (ISO 4397) in which oil at rated flow is no faster than
4.6 m/s, the most that is recommended of pressure hoses (Rabie, Fluid Power Engineering, McGraw-Hill 2009, ch. 3), and
the length of the typical resonance.
"""

import math
from collections.abc import Callable
from functools import partial

import casadi as ca
import numpy as np

from ....rigs.rig import Rig
from ...gas import Filling, filling
from ..decorator import effect, number, state
from ..effect import EffectNumber, Scope

_Pair = tuple[ca.SX, ca.SX]
_ONSET = 1e-6  # of the chamber's volume, over which a line comes on; wider, a share of a small line is like a large one
_LEAST = 1e-2  # of it: the volume of a line that is coming on


_SPEED = 4.6  # m/s: of the oil at rated flow
_BORES = 1e-3 * np.array([3.2, 4, 5, 6.3, 8, 10, 12.5, 16, 19, 25, 31.5, 38, 51, 63, 76, 102])  # m
_DENSITY = 850.0  # kg/m^3, of mineral oil
_WIDEST, _RESONANCE = 3.0, 150.0  # r; f [Hz]


def mean_volume(rig: Rig) -> float:
    """The mean volume [m^3] of a rig's chambers at mid stroke."""
    return rig["S"] / 2 * float(np.mean(rig.areas)) + float(np.mean(rig.dead_volumes))


def usual(rig: Rig) -> dict[str, float]:
    """The r, within its range, of a line whose bore suits a rig's rated flow."""
    from ...valve import VALVES  # here: their graphs have slots for effects

    wanted = math.sqrt(4 * float(VALVES[rig.valve].rated_flow(rig)) / (math.pi * _SPEED))
    bore = next((bore for bore in _BORES if bore >= wanted), wanted)
    length = math.sqrt(rig["beta"] / _DENSITY) / (2 * math.pi * _RESONANCE)
    return {"r": min(math.pi / 4 * float(bore) ** 2 * length / mean_volume(rig), _WIDEST)}


def _on(s: Scope) -> ca.SX:
    return 1 - ca.exp(-s.p("r") / _ONSET)


def _mixed(value: ca.SX, line: ca.SX, s: Scope) -> ca.SX:
    return value + _on(s) * (line - value)


def capacitance(r: ca.SX | float, volume: ca.SX | float, beta: ca.SX | float) -> ca.SX:
    """C [m^3/Pa] of a line, of its share r of the chambers' mean volume [m^3]."""
    return ca.fmax(r, _LEAST) * volume / beta


def _near(s: Scope, side: str) -> Filling:
    """What fills the line of a side."""
    return filling(s.x(f"P{side}"), *(s[name] for name in ("saturation", "vapour", "gas", "beta")))


def _near_ends(ports: _Pair, s: Scope) -> _Pair:
    """PA, PB in place of pA, pB."""
    return _mixed(ports[0], _near(s, "A").pressure, s), _mixed(ports[1], _near(s, "B").pressure, s)


def _through(flows: _Pair, s: Scope, slowed: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]) -> _Pair:
    """qA, qB in place of QA, QB; `slowed` is C w0^2 dp of a flow, with C and w0."""
    w0, capacity = 2 * ca.pi * s.p("f"), capacitance(s.p("r"), s["volume"], s["beta"])
    through = []
    for side, chamber, room, flow, sign in (
        ("A", s["pa"], s["room_a"], flows[0], 1),
        ("B", s["pb"], s["room_b"], flows[1], -1),
    ):
        q, near = s.x(f"q{side}"), _near(s, side)
        given, oil = flow / ca.if_else(sign * flow > 0, 1, near.room), q / ca.if_else(sign * q > 0, near.room, room)
        s.rate(f"P{side}", near.grown(sign * (given - oil)) / capacity)
        s.rate(f"q{side}", sign * capacity * w0 * w0 * (near.pressure - chamber) - slowed(q, capacity, w0))
        through.append(_mixed(flow, oil, s))
    return through[0], through[1]


def _numbers(loss: EffectNumber) -> tuple[EffectNumber, ...]:
    volume, frequency = "volume of a line over the chambers' mean one at mid stroke", "resonance of the line alone"
    return (
        number("r", 0.1, "1", shown="%", low=0.0, high=_WIDEST, off=0.0, meaning=volume, tried=(0.03, 0.4)),
        number("f", _RESONANCE, "Hz", low=5.0, high=1000.0, meaning=frequency, tried=(50.0, 400.0)),
        loss,
    )


_hose = partial(
    effect,
    "line.hose",
    equation="flow",
    slot="line_flows",
    also={"ports": _near_ends},
    source="Watton, Fundamentals of Fluid Power Control, Cambridge 2009, ch. 5: a line of lumped parameters",
    shows="fast multisines and steps of the command, with both pressures, and acceleration or position, recorded",
    states=(
        state("PA", "Pa", 1e7, follows="P1"),
        state("PB", "Pa", 1e7, follows="P2"),
        state("qA", "m^3/s", 1e-3),
        state("qB", "m^3/s", 1e-3),
    ),
    described="ChA",
    usual=usual,
)


@_hose("lumped", numbers=_numbers(number("zeta", 0.2, "1", low=0.02, high=2.0, meaning="its damping ratio")))
def lumped(flows: _Pair, s: Scope) -> _Pair:
    """qA, qB in place of QA, QB, with dp(q) = 2 zeta q/(w0 C): laminar."""
    return _through(flows, s, lambda q, _, w0: 2 * s.p("zeta") * w0 * q)


@_hose(
    "turbulent",
    numbers=_numbers(
        number(
            "loss",
            0.05,
            "1",
            shown="%",
            low=0.0,
            high=1.0,
            meaning="drop at rated flow over supply pressure",
            tried=(0.005, 0.3),
        )
    ),
)
def turbulent(flows: _Pair, s: Scope) -> _Pair:
    """qA, qB in place of QA, QB, with dp(q) = loss Ps q |q|/Qr^2."""

    def slowed(q: ca.SX, capacity: ca.SX, w0: ca.SX) -> ca.SX:
        return capacity * w0 * w0 * s.p("loss") * s["feed"] * q * ca.fabs(q) / s["rated"] ** 2

    return _through(flows, s, slowed)
