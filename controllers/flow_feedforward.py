"""Flow feed-forward: a step becomes a motion that the jack can make, and the command for its flow goes ahead of it."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.protocol import design_numbers, number
from workbench.control.reference_plan import FlowNumbers, ReferencePlan


class FlowFeedForward:
    """u += (v + (1 - (x/h)^2) (T s/(s + c) a + j/w^2))/Kv sqrt(dp/(ps - pr - sign(u) m a)).

    The controller's reference is made a motion within `speed` and `acceleration`, averaged over `smoothing`: it limits
    its jerk to their quotient, and an average over a period of a mode does not excite it. v, a and j are the slopes of
    the motion; the controller sees it later by the `lead`, which is what valve and computing take. T is what the
    controller's damping answers to an acceleration, K m Kv for a pressure feedback K above c. w is the mass on the oil
    at mid stroke, where that is softest: it is stiffer towards the ends of its columns h. The flow through the lands
    goes with the root of the pressure that the load, m a, leaves for them; the supply is as declared, or, as far as it
    is believed, as measured (Merritt, Hydraulic Control Systems, 1967; Jelali and Kroll, Hydraulic Servo-Systems, 2003,
    ch. 6). An inverse of the lap stands around it.
    """

    into: ClassVar[Literal["graph"]] = "graph"

    @design_numbers
    class Design:
        """Design numbers."""

        velocity_gain: float = number("m/s", 1e-3, 1e3, "speed of the jack per unit of command Kv")
        acceleration: float = number("m/s^2", 1e-3, 1e4, "largest acceleration of the motion")
        smoothing: float = number("s", 0.0, 1.0, "over which the motion is averaged")
        speed: float = number("m/s", 1e-3, 10.0, "largest speed of the motion", 10.0)
        lead: float = number("s", 0.0, 0.1, "of the command over the controller's reference", 0.0)
        lag: float = number("s", 0.0, 0.1, "speed that the damping takes off per acceleration T", 0.0)
        corner: float = number("Hz", 0.0, 100.0, "corner of the damping's high pass c; 0: none", 0.0)
        mode: float = number("Hz", 0.1, 1e4, "natural frequency of the mass on the oil w", 1e4)
        inertia: float = number("Pa s^2/m", 0.0, 1e9, "load pressure per acceleration m: mass over area", 0.0)
        drop: float = number("Pa", 1e4, 1e9, "pressure from supply to return at which Kv was found", 2e7)
        drain: float = number("Pa", 0.0, 1e8, "pressure of the return", 0.0)
        column: float = number("m", 0.0, 100.0, "half the oil columns' length h; 0: the same all over", 0.0)
        middle: float = number("m", -100.0, 100.0, "position signal at mid stroke", 0.0)
        measured: float = number("1", 0.0, 1.0, "how far the measured supply is believed; 0: not measured", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        d, mode = design, 1 / (2 * np.pi * design.mode) ** 2
        flow = FlowNumbers(
            d.velocity_gain, d.lag, mode, d.inertia, d.drop, d.drain, d.measured, d.corner, d.column, d.middle
        )
        self.shell = ReferencePlan(d.speed, d.acceleration, d.smoothing, d.lead, period, flow)
