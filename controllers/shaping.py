"""Reference shaping: the second degree of freedom, which no margin sees."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.compensators import weighted
from workbench.control.protocol import design_numbers, number


class Shaping:
    """The controller's reference is ((s/n)^2 + T s + 1)/(s/w + 1)^2 r: slower with T = 0, faster with T w > 2.

    The loop alone decides how disturbances are met and how near it is to instability; how a reference is followed is
    then free (Åström and Hägglund, Advanced PID Control, 2006). With a notch n the zeros swing as the loop's mode does,
    T = 2 z/n with its damping z: a step does not excite that, and goes through at once (Singer and Seering,
    Preshaping command inputs to reduce system vibration, J. Dynamic Systems, Measurement and Control 112(1), 1990).
    Several in series, of one corner, give a step any shape of twice as many lags: zeros over a range of modes.
    """

    into: ClassVar[Literal["command", "reference"]] = "reference"

    @design_numbers
    class Design:
        """Design numbers."""

        corner: float = number("Hz", 0.1, 1e4, "corner w of the two lags")
        lead: float = number("s", 0.0, 10.0, "lead time T", 0.0)
        notch: float = number("Hz", 0.0, 1e4, "frequency n of the zeros; 0: none", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        lag = 1 / (2 * np.pi * design.corner)
        zeros = [1 / (2 * np.pi * design.notch) ** 2] if design.notch else []
        self.law = weighted([*zeros, design.lead, 1], [lag**2, 2 * lag, 1], period, {"reference": 1.0})
