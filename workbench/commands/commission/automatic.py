"""A controller by rules, from small moves alone, which any model has to beat."""

from ...control.automatic_tuning import SmallMoves, tuned
from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...rigs.rig import Rig
from ..excite.study import drive
from .looks import pulses


def automatic(rig: Rig, moves: SmallMoves) -> ControllerSpec:
    """The controller that small moves give; without pressures to feed back the slow loop of the drive."""
    if not {"pa", "pb"} <= rig.sensors.keys():
        return drive(rig).loop.named("automatic")
    return tuned(moves, column(rig), rig.middle)


def self_tuning(rig: Rig) -> ControllerSpec:
    """The controller that makes these moves itself, sized and held as the datasheet's rig allows."""
    numbers = {
        "hold": drive(rig).loop.design.gain,
        "pulse": pulses(rig)[1],
        "column": column(rig),
        "middle": rig.middle,
    }
    return controller("controllers.automatic:Automatic", **numbers)


def column(rig: Rig) -> float:
    """Length [m] of the oil columns at mid stroke, dead volumes included."""
    (area, _), (volume, _) = rig.areas, rig.dead_volumes
    return rig["S"] / 2 + volume / area
