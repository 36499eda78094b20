"""A valve in the line of a side, behind the servo-valve: a pilot-operated check or a counterbalance valve.

Between the servo-valve and it the line is a volume of its own, at the pressure pl, beside pc of the chamber; the pilot
is the other side's line, px. Both open in proportion to the pressure beyond what balances their spring. A check valve
has one seat, whose poppet a pilot piston in the line lifts too,

    Q = K o((pl - pc + r max(px - pl, 0) - p0)/d) q(pl - pc)

with q the plant's signed root, p0 cracking it, and d lifting it fully (the Simscape Fluids pilot-operated check valve,
pilot relative to port A). A counterbalance valve has a check, r = 0, and beside it a valve that load and pilot open,

    Q = [K o((pl - pc - p0)/d) + Kr o((pc + r px - rb pl - ps)/s)] q(pl - pc)

against the setting ps, all pressures counted from the atmosphere (the Simscape Fluids counterbalance valve, pilot and
back pressure ratios). Of makers, "back pressure adds to the setting at 1 plus the pilot ratio" is rb = 1 + r; rb = 0 is
a vented spring. The share o of its opening is its argument from 0 to 1, rounded within 5 % of both ends. Poppets have
no mass: they move within some milliseconds.
"""

import casadi as ca

from ..rigs.line_valve import CHECK, LineValve
from ..rigs.oil import ATMOSPHERE
from .assembly import Assembly
from .jack import Chambers
from .oil import Chamber, above_vacuum, chamber, continuity
from .orifice import root

_Pair = tuple[ca.SX, ca.SX]
Lines = tuple[Chamber | None, Chamber | None]
"""The volume before the line valve of each side that has one."""

_KNEE = 0.05  # of the way from shut to open, on both sides of either end


def lines(b: Assembly, valve: LineValve | None, jack: Chambers, rest: float) -> Lines:
    """Declare the line of each side that has a valve in it, at rest at about `rest` [Pa]."""
    on = valve.on if valve else (False, False)
    a, b_ = (
        chamber(b, name, b.magnitude("Ps"), rest, follows=of.name) if there else None
        for name, of, there in zip(("PLA", "PLB"), (jack.a, jack.b), on, strict=True)
    )
    return a, b_


def ends(between: Lines, jack: Chambers) -> tuple[Chamber, Chamber]:
    """What each line of the servo-valve ends in: the line before a line valve, or the chamber."""
    return between[0] or jack.a, between[1] or jack.b


def passed(b: Assembly, valve: LineValve | None, between: Lines, jack: Chambers, flows: _Pair) -> _Pair:
    """Fill the lines by the flows [m^3/s] into A and out of B; what comes through their valves to the chambers."""
    at, through = ends(between, jack), list(flows)
    for side, (line, of, sign) in enumerate(zip(between, (jack.a, jack.b), (1, -1), strict=True)):
        if valve and line:
            flow = _flow(b, valve, line.pressure, of.pressure, at[1 - side].pressure)
            modulus = b.slot("modulus", b["beta"], pressure=line.pressure)
            continuity(b, line, sign * flows[side] - flow, b["line_volume"], modulus=modulus)
            through[side] = sign * flow
    return through[0], through[1]


def _flow(b: Assembly, valve: LineValve, line: ca.SX, of: ca.SX, pilot: ca.SX) -> ca.SX:
    """Flow [m^3/s] into the chamber `of` [Pa] from the `line` [Pa] at the pressure `pilot` [Pa] of the other line."""
    lifted = line - of - b["line_cracking"]
    if valve.kind == CHECK:
        lifted += b["line_ratio"] * ca.fmax(pilot - line, 0)
    conductance = b["line_flow"] * _opening(lifted / b["line_lift"])
    if valve.kind != CHECK:
        load, pilot, back = (pressure - (ATMOSPHERE - above_vacuum(b)) for pressure in (of, pilot, line))
        beyond = load + b["line_ratio"] * pilot - b["line_back_ratio"] * back - b["line_setting"]
        conductance += b["line_return"] * _opening(beyond / b["line_span"])
    return conductance * root(line - of)


def _opening(way: ca.SX) -> ca.SX:
    """Share of its opening of a valve that is pressed a `way` from shut, 0, to open, 1."""
    return _positive(way) - _positive(way - 1)


def _positive(way: ca.SX) -> ca.SX:
    """The positive part, with a parabola about 0."""
    knee = ca.fmin(ca.fmax(way + _KNEE, 0), 2 * _KNEE)
    return ca.fmax(way - _KNEE, 0) + knee * knee / (4 * _KNEE)
