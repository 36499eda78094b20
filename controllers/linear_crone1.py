"""CRONE, first generation, on any linear plant."""

from typing import ClassVar

from workbench.control.linear_model import LinearModel
from workbench.control.protocol import design_numbers
from workbench.control.second_order_sections import SectionController
from workbench.rigs.linear_rig import LinearRig

from .crone1 import ConstantPhase, constant_phase


class LinearCrone1(SectionController):
    """A constant phase of the law about the crossover, as Crone1 has it, on the loop's own plant.

    Where the plant does not integrate, give it an `integral`, or an error stays.
    """

    of_linear_plants: ClassVar[bool] = True

    @design_numbers
    class Design(ConstantPhase):
        """Design numbers: what the loop should do on the plant."""

    def __init__(self, design: Design, period: float, plant: LinearRig) -> None:
        super().__init__(*constant_phase(design, LinearModel(plant, period), period), period)
