"""LQG on any linear plant whose position is all that is measured."""

from typing import ClassVar

from workbench.control.law import LawController
from workbench.control.linear_model import LinearObserver, ObservedPlant
from workbench.control.protocol import design_numbers, number
from workbench.rigs.linear_rig import LinearRig

from .lqg import lq_gain


class LinearLqg(LawController):
    """u = u0 - K (x^ - x0): state feedback on what a Kalman filter sees in the position of the loop's own plant.

    K minimises the sum of (e/error)^2 + u^2. x0 and u0 hold the plant at the reference against the disturbance that the
    filter sees, so that a constant one leaves no error, wherever it acts.
    """

    of_linear_plants: ClassVar[bool] = True

    @design_numbers
    class Design(ObservedPlant):
        """Design numbers: what the filter trusts, and what an error costs."""

        error: float = number("m", 1e-9, 1e3, "the position error that costs as much as full command", 0.1)

    def __init__(self, design: Design, period: float, plant: LinearRig) -> None:
        observer = LinearObserver(plant, design, period)
        super().__init__(observer.law(observer.state_law(lq_gain(observer, design.error)), period))
