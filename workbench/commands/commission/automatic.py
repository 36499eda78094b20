"""A controller by rules, from small moves alone: P with pressure feedback, which any model has to beat.

The pressure gain K gives the oil's mode w the damping ratio K Kv w M / (2 A), Kv the speed gain (dynamic pressure
feedback, Merritt, Hydraulic Control Systems, 1967, ch. 6); the loop gain is a share of the one at which a mode of
damping ratio zeta becomes unstable, 2 zeta w (ibid.).
"""

from math import pi, sqrt

from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...loop.capability import oil_stiffness
from ...rigs.rig import Rig
from .looks import SmallMoves

DAMPING = 0.35  # wanted of the mode: about null a lap may double it
SHARE = 0.25  # of the greatest loop gain: again a lap, and a valve that is late
_CORNER = 0.5  # Hz above which pressures are fed back


def automatic(rig: Rig, moves: SmallMoves) -> ControllerSpec:
    """The controller that small moves give; where nothing rings after them, for the oil of the datasheet."""
    w = 2 * pi * moves.mode_hz if moves.mode_hz else sqrt(oil_stiffness(rig) / rig["M"])
    gain = SHARE * 2 * DAMPING * w / moves.speed_gain
    law = controller("controllers.p:P", gain=float(f"{gain:.3g}"))
    if "pa" not in rig.sensors or "pb" not in rig.sensors:
        return law.named("automatic")
    pressure = 2 * DAMPING * min(rig.areas) / (rig["M"] * w) / moves.speed_gain
    feedback = controller(
        "controllers.pressure:PressureFeedback", gain=float(f"{pressure:.3g}"), corner=_CORNER, column=column(rig)
    )
    return (law + feedback).named("automatic")


def column(rig: Rig) -> float:
    """Length [m] of the oil columns at mid stroke, dead volumes included."""
    (area, _), (volume, _) = rig.areas, rig.dead_volumes
    return rig["S"] / 2 + volume / area
