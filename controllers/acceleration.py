"""Acceleration feedback: damps the jack on its oil by what the mass does."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.compensators import weighted
from workbench.control.protocol import design_numbers, number


class AccelerationFeedback:
    """u -= K a/(s/w + 1).

    On a jack with natural frequency wn and velocity gain Kv [m/s] it adds the damping K Kv wn/2 (Jelali and Kroll,
    Hydraulic Servo-Systems, 2003, ch. 6). A load that is held still does not disturb it, as it does pressure feedback.
    """

    into: ClassVar[Literal["command", "reference"]] = "command"

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("s^2/m", 0.0, 1.0, "command per acceleration K")
        corner: float = number("Hz", 1.0, 1e4, "corner of the low pass that keeps noise out", 200.0)

    def __init__(self, design: Design, period: float) -> None:
        lag = 1 / (2 * np.pi * design.corner)
        self.law = weighted([1], [lag, 1], period, {"acceleration": -design.gain})
