"""Feed-forward of the reference, its velocity and its acceleration."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.compensators import weighted
from workbench.control.protocol import design_numbers, number


class FeedForward:
    """u += (Kh + Kv s + Ka s^2)/(s/w + 1)^2 r.

    Kv is one over the jack's velocity gain: a ramp then is followed without an error. With a damping d fed back at the
    natural frequency wn, Ka = 2 d Kv/wn takes the lag out of what follows (Jelali and Kroll, Hydraulic Servo-Systems,
    2003, ch. 6). Kh is for force loops: the command that makes up for what leaks under the force asked for. A step of
    the reference goes through all of it as a blow: shape the reference outside of it.
    It goes around what a controller plans for its reference: Mpc takes a Shaping instead.
    """

    into: ClassVar[Literal["command", "reference"]] = "command"

    @design_numbers
    class Design:
        """Design numbers."""

        velocity: float = number("s/m", 0.0, 1e3, "command per velocity of the reference Kv", 0.0)
        acceleration: float = number("s^2/m", 0.0, 10.0, "command per acceleration of the reference Ka", 0.0)
        corner: float = number("Hz", 0.1, 1e4, "corner of the differentiating filter", 50.0)
        hold: float = number("1/m", 0.0, 1e3, "command that holds the reference Kh", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        lag = 1 / (2 * np.pi * design.corner)
        forward = [design.acceleration, design.velocity, design.hold]
        self.law = weighted(forward, [lag**2, 2 * lag, 1], period, {"reference": 1.0})
