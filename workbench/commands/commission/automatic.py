"""A controller by rules, from small moves alone: P with pressure feedback, which any model has to beat.

The pressure gain K gives the oil's mode w the damping ratio K Kv w M / (2 A), Kv the speed gain (dynamic pressure
feedback, Merritt, Hydraulic Control Systems, 1967, ch. 6); the loop gain is a share of the one at which a mode of
damping ratio zeta becomes unstable, 2 zeta w (ibid.).
"""

from math import pi

from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...rigs.rig import Rig
from .looks import SmallMoves

DAMPING = 0.35  # wanted of the mode: about null a lap may double it
SHARE = 0.25  # of the greatest loop gain: again a lap, and a valve that is late
_UNSEEN = 3.0  # 1/s: loop gain where nothing rings
_CORNER = 0.5  # Hz above which pressures are fed back


def automatic(rig: Rig, moves: SmallMoves) -> ControllerSpec:
    """The controller that small moves give."""
    if moves.mode_hz is None or moves.speed_per_pressure is None or "pa" not in rig.sensors:
        return controller("controllers.p:P", gain=_UNSEEN / moves.speed_gain).named("automatic")
    wanted = max(0.0, DAMPING - (moves.mode_damping or 0.0))
    pressure = 2 * wanted * moves.speed_per_pressure / moves.speed_gain
    gain = SHARE * 2 * DAMPING * 2 * pi * moves.mode_hz / moves.speed_gain
    law = controller("controllers.p:P", gain=float(f"{gain:.3g}"))
    feedback = controller(
        "controllers.pressure:PressureFeedback", gain=float(f"{pressure:.3g}"), corner=_CORNER, column=column(rig)
    )
    return (law + feedback).named("automatic")


def column(rig: Rig) -> float:
    """Length [m] of the oil columns at mid stroke, dead volumes included."""
    (area, _), (volume, _) = rig.areas, rig.dead_volumes
    return rig["S"] / 2 + volume / area
