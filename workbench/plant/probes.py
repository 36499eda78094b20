"""Probes: effects without numbers that only add inputs, so that a disturbance can be added to one equation at a time.

They carry no physics: with their inputs at zero the plant is the base plant. Each one's `equation` says where it acts.
"""

from collections.abc import Callable
from typing import Any

import casadi as ca

from ..rigs.rig import Rig
from .effects import Effect, EffectInput, Scope

_Pair = tuple[ca.SX, ca.SX]
_Law = Callable[[Any, Scope], Any]


def _added(name: str) -> _Law:
    def law(value: ca.SX, s: Scope) -> ca.SX:
        """value + input."""
        return value + s.u(name)

    return law


def _pushed(force: ca.SX, s: Scope) -> ca.SX:
    """A force against motion less the input, which pushes along it."""
    return force - s.u("force")


def _fed(leaks: _Pair, s: Scope) -> _Pair:
    """Leaks from the chambers less what the inputs feed into them."""
    return leaks[0] - s.u("into_a"), leaks[1] - s.u("into_b")


def _probe(equation: str, laws: dict[str, _Law], *inputs: EffectInput) -> Effect:
    return Effect(f"probe.{equation}", "", equation, "no physics: a disturbance", "any", laws, inputs=inputs)


def probes(rig: Rig) -> tuple[Effect, ...]:
    """The probes that this rig's plant has room for, one an equation; SI inputs, their scales clearly visible.

    drive: A on the measured current, or of a second-order valve on its command [1]. pilot: A on the current that makes
    torque. main: N along the main spool's motion. flow: m^3/s into chambers A and B, and
    Pa on the supply. force: N on the moving mass along
    positive motion, not in the load cell. sensor: Pa on the signals of pa and pb.
    """
    area, pressure = max(rig[name] for name in ("Aj", "AA", "AB") if name in rig.numbers), 0.05 * rig["Ps"]
    flow = 0.02 * rig["n"] * rig["K3"] * rig["z3max"] * rig["Ps"] ** 0.5
    known = [
        _probe(
            "flow",
            {"leakage": _fed, "supply": _added("supply")},
            EffectInput("into_a", "m^3/s", flow),
            EffectInput("into_b", "m^3/s", flow),
            EffectInput("supply", "Pa", pressure),
        ),
        _probe("force", {"body_force": _pushed}, EffectInput("force", "N", pressure * area)),
        _probe(
            "sensor",
            {"sensor_pa": _added("pa"), "sensor_pb": _added("pb")},
            EffectInput("pa", "Pa", pressure),
            EffectInput("pb", "Pa", pressure),
        ),
    ]
    if rig.valve == "second-order":
        return (_probe("drive", {"command": _added("command")}, EffectInput("command", "1", 0.05)), *known)
    current = 0.05 * rig["imax"]
    return (
        _probe("drive", {"current": _added("current")}, EffectInput("current", "A", current)),
        _probe("pilot", {"motor_current": _added("current")}, EffectInput("current", "A", current)),
        _probe("main", {"main_friction": _pushed}, EffectInput("force", "N", 0.1 * rig["S3"] * rig["Ps"])),
        *known,
    )
