"""Pressure feedback: the difference of the chamber pressures damps the jack on its oil."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.discrete_filter import weighted
from workbench.control.protocol import design_numbers, number


class PressureFeedback:
    """u -= K s/(s + w) (pa - pb): dynamic pressure feedback; with w = 0 static pressure-difference feedback.

    On a symmetric jack of area A and mass M with natural frequency wn and velocity gain Kv [m/s] it adds the damping
    K Kv wn M/(2 A), as leakage past the piston would, but for the lag of the valve (Merritt, Hydraulic Control Systems,
    1967; Jelali and Kroll, Hydraulic Servo-Systems, 2003, ch. 6). Static feedback gives way to a steady load,
    again as leakage does; dynamic feedback leaves out what is slower than w.
    """

    into: ClassVar[Literal["command", "reference"]] = "command"

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/Pa", 0.0, 1e-6, "command per pressure difference K")
        corner: float = number("Hz", 0.0, 100.0, "corner of the high pass; 0: static feedback", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        weights = {"pa": -design.gain, "pb": design.gain}
        corner = 2 * np.pi * design.corner
        self.law = weighted([1, 0], [1, corner], period, weights) if corner else weighted([1], [1], period, weights)
