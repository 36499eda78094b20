"""Velocity compensation: a force loop that gives the jack the flow that its own motion takes."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.compensators import weighted
from workbench.control.protocol import design_numbers, number


class VelocityCompensation:
    """u += K s/(s/w + 1)^2 x, x the jack's position: where the specimen goes, the jack goes along.

    A jack that is carried along at v takes the command v/Kv, which a force loop without it pays for with a force error
    (the natural velocity feedback of Dyke, Spencer, Quast, Sain, J. Engineering Mechanics 121(2), 1995). K is a part of
    one over the velocity gain Kv. It is positive feedback: a whole one over the gain at null, where the lap doubles it,
    lets the jack drift with any push, and a high corner w meets the oil's mode.
    """

    into: ClassVar[Literal["command", "reference"]] = "command"

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("s/m", 0.0, 1e3, "command per velocity of the jack K")
        corner: float = number("Hz", 0.1, 1e4, "corner w of the differentiating filter")

    def __init__(self, design: Design, period: float) -> None:
        lag = 1 / (2 * np.pi * design.corner)
        self.law = weighted([design.gain, 0], [lag**2, 2 * lag, 1], period, {"position": 1.0})
