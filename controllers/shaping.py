"""Reference shaping: the second degree of freedom, which no margin sees."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.discrete_filter import weighted
from workbench.control.protocol import design_numbers, number


class Shaping:
    """The controller's reference is (T s + 1)/(s/w + 1)^2 r: slower with T = 0, faster with T w > 2.

    The loop alone decides how disturbances are met and how near it is to instability; how a reference is followed is
    then free (Åström and Hägglund, Advanced PID Control, 2006).
    """

    into: ClassVar[Literal["command", "reference"]] = "reference"

    @design_numbers
    class Design:
        """Design numbers."""

        corner: float = number("Hz", 0.1, 1e4, "corner w of the two lags")
        lead: float = number("s", 0.0, 10.0, "lead time T", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        lag = 1 / (2 * np.pi * design.corner)
        self.law = weighted([design.lead, 1], [lag**2, 2 * lag, 1], period, {"reference": 1.0})
