"""Probes: effects without numbers that only add inputs, so that a disturbance can be added to one equation at a time.

They carry no physics: with their inputs at zero the plant is the base plant. Each one's `equation` says where it acts.
"""

from collections.abc import Callable
from typing import Any

import casadi as ca

from ..rigs.load import ROD_CELL
from ..rigs.rig import Rig
from .effects import Effect, EffectInput, Scope
from .valve import VALVES, ProbePoint

_Pair = tuple[ca.SX, ca.SX]
_Law = Callable[[Any, Scope], Any]


def _added(name: str) -> _Law:
    def law(value: ca.SX, s: Scope) -> ca.SX:
        """value + input."""
        return value + s.u(name)

    return law


def _pushed(name: str = "force") -> _Law:
    def law(force: ca.SX, s: Scope) -> ca.SX:
        """A force against motion less the input, which pushes along it."""
        return force - s.u(name)

    return law


def _fed(leaks: _Pair, s: Scope) -> _Pair:
    """Leaks from the chambers less what the inputs feed into them."""
    return leaks[0] - s.u("into_a"), leaks[1] - s.u("into_b")


def _probe(equation: str, laws: dict[str, _Law], *inputs: EffectInput) -> Effect:
    return Effect(f"probe.{equation}", "", equation, "no physics: a disturbance", "any", laws, inputs=inputs)


def _at(point: ProbePoint) -> Effect:
    law = _pushed() if point.against_motion else _added(point.name)
    return _probe(point.equation, {point.slot: law}, EffectInput(point.name, point.unit, point.scale))


def probes(rig: Rig) -> tuple[Effect, ...]:
    """The probes that this rig's plant has room for, one an equation; SI inputs, their scales clearly visible.

    drive, pilot and main: those of the valve, see `Valve.probe_points`. flow: m^3/s into chambers A and B, and Pa on
    the supply. force: N on the moving mass along positive motion, not in the load cell; on the piston too where a cell
    on its rod tells the two apart. sensor: Pa on the signals of pa and pb.
    """
    area, pressure = max(rig.areas), 0.05 * rig["Ps"]
    on_rod = rig.load == ROD_CELL
    flow = 0.02 * VALVES[rig.valve].usual_flow(rig)
    beyond_valve = [
        _probe(
            "flow",
            {"leakage": _fed, "supply": _added("supply")},
            EffectInput("into_a", "m^3/s", flow),
            EffectInput("into_b", "m^3/s", flow),
            EffectInput("supply", "Pa", pressure),
        ),
        _probe(
            "force",
            {"body_force": _pushed()} | ({"friction": _pushed("piston")} if on_rod else {}),
            *(EffectInput(name, "N", pressure * area) for name in (("force", "piston") if on_rod else ("force",))),
        ),
        _probe(
            "sensor",
            {"sensor_pa": _added("pa"), "sensor_pb": _added("pb")},
            EffectInput("pa", "Pa", pressure),
            EffectInput("pb", "Pa", pressure),
        ),
    ]
    return (*(_at(point) for point in VALVES[rig.valve].probe_points(rig)), *beyond_valve)
