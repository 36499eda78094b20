"""What a robustness study asks: a step by every controller, on plants drawn over what is uncertain of a rig."""

from collections.abc import Mapping
from dataclasses import dataclass

from ...base.signals import Signal
from ...control.controller_spec import ControllerSpec
from ...rigs.rig import Rig
from ..rig_variations import Conditions


@dataclass(frozen=True)
class RobustnessProblem:
    """A step of a signal (SI) watched for so many seconds, on plants drawn by the seed of the `conditions`.

    Drawn are factors [low, high] by name, and all other numbers that the rig gives bounds within them: both are those
    of a rig that is known as well as is asked. `stroke`: the share of the stroke limit in which steps lie;
    `positions`: the shares of it at which every plant's linear loops are judged. `moves`: as many steps, there and
    back, each watched as long, come before the one that is judged.
    """

    rig: Rig
    plants: int
    conditions: Conditions
    signal: Signal
    step: float
    seconds: float
    stroke: float
    positions: tuple[float, ...]
    factors: Mapping[str, tuple[float, float]]
    controllers: tuple[ControllerSpec, ...]
    moves: int = 0
