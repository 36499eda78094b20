"""A controller by rules, from small moves alone, which any model has to beat."""

from typing import Any

import numpy as np

from ..base.errors import InputError
from ..control.automatic_tuning import MOVE, PULSE, SmallMoves, pulses, tuned
from ..control.controller_spec import ControllerSpec
from ..control.controller_type import controller
from ..linear import equilibrium
from ..plant import build
from ..rigs.rig import Rig
from .drive_simulation import drive
from .rows import LoopSetup
from .sampled_loop import SampledLoop

_LARGEST_PULSE = 0.2  # of full command
_OVER_NOISE = 20  # times the position sensor's noise that a move goes at least


def automatic(rig: Rig, moves: SmallMoves) -> ControllerSpec:
    """The controller that small moves give; without pressures to feed back the slow loop of the drive."""
    if not {"pa", "pb"} <= rig.sensors.keys():
        return drive(rig).loop.named("automatic")
    return tuned(moves, column(rig), rig.middle)


def tuned_on(moving: ControllerSpec, setup: LoopSetup, noise: int | None) -> ControllerSpec:
    """What the controller is in the end that tunes itself on a rig, from mid stroke; `noise`: the seed of the sensors'.
    Raises InputError where its moves are cut short."""
    period = setup.rig.period.value
    controller: Any = moving.build(period)
    loop = SampledLoop(setup.engine, setup.rig, controller, setup.null, noise)
    run = loop.run(np.full(len(pulses(moving.design.pulse, period)), setup.rig.middle))
    if run.tripped or controller.law is None:
        why = f": {run.tripped}; look at its limits" if run.tripped else "; look at its file"
        raise InputError(f"the small moves on {setup.rig.name} were cut short{why}")
    return controller.law


def self_tuning(rig: Rig) -> ControllerSpec:
    """The controller that makes these moves itself, sized and held as the datasheet's rig allows."""
    numbers = {
        "hold": drive(rig).loop.design.gain,
        "pulse": _pulse(rig),
        "column": column(rig),
        "middle": rig.middle,
    }
    return controller("controllers.automatic:Automatic", **numbers)


def small_way(rig: Rig) -> float:
    """A millimetre, or more where the position sensor's noise would hide it [m]."""
    return max(MOVE, _OVER_NOISE * rig.sensors["position"].noise) if "position" in rig.sensors else MOVE


def _pulse(rig: Rig) -> float:
    """The command of pulses that move the declared rig a small way."""
    way = small_way(rig)
    plant = build(rig)
    smooth = plant.without_dry_friction()
    command = abs(float(equilibrium(plant, speed=way / PULSE, p=smooth).u[0]))
    return float(np.clip(command, 1e-3, _LARGEST_PULSE))


def column(rig: Rig) -> float:
    """Length [m] of the oil columns at mid stroke, dead volumes included."""
    (area, _), (volume, _) = rig.areas, rig.dead_volumes
    return rig["S"] / 2 + volume / area
