"""Pressure feedback: the difference of the chamber pressures damps the jack on its oil."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.compensators import weighted
from workbench.control.piecewise_linear import PiecewiseLinear
from workbench.control.protocol import design_numbers, number

_POINTS = 41  # of the schedule, over both columns: chords within 0.3 % of it


class PressureFeedback:
    """u -= K s/(s + w) (pa - pb - p r): dynamic pressure feedback; with w = 0 static pressure-difference feedback.

    On a symmetric jack of area A and mass M with natural frequency wn and velocity gain Kv [m/s] it adds the damping
    K Kv wn M/(2 A), as leakage past the piston would, but for the lag of the valve (Merritt, Hydraulic Control Systems,
    1967; Jelali and Kroll, Hydraulic Servo-Systems, 2003, ch. 6). Static feedback gives way to a steady load,
    again as leakage does; dynamic feedback leaves out what is slower than w.

    The oil of a jack with equal sides is softest at mid stroke, where a pressure tells least of a motion: its stiffness
    over the position x goes with 1/(1 - (x/h)^2), h half the length of both oil columns, dead volumes included
    (Merritt, ch. 6). With a `column` h the gain K is that at mid stroke, and goes with 1 - (x/h)^2: the loop then has
    the same gain all over the stroke. The mode is faster at the ends, where the valve lags it more: a shorter column
    than the jack's, which takes more of the gain away there, evens out the margins.

    In a force loop the reference r asks for a pressure of its own, p r: taken off, it leaves feedback of what the
    pressure is short of, and even a static one does not give way. p is the specimen's stiffness over the area, for
    there r is a deflection.
    """

    into: ClassVar[Literal["command", "reference"]] = "command"

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/Pa", 0.0, 1e-6, "command per pressure difference K")
        corner: float = number("Hz", 0.0, 100.0, "corner of the high pass; 0: static feedback", 0.0)
        column: float = number(
            "m", 0.0, 100.0, "half the oil columns' length h, or less; 0: the same gain all over", 0.0
        )
        middle: float = number("m", -100.0, 100.0, "position signal at mid stroke", 0.0)
        reference: float = number("Pa/m", 0.0, 1e14, "pressure that a force loop's reference asks for p", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        weights = {"pa": -design.gain, "pb": design.gain}
        if design.reference:
            weights["reference"] = design.gain * design.reference
        corner = 2 * np.pi * design.corner
        self.law = weighted([1, 0], [1, corner], period, weights) if corner else weighted([1], [1], period, weights)
        self.schedule = _over_stroke(design.column, design.middle) if design.column else None


def _over_stroke(column: float, middle: float) -> PiecewiseLinear:
    """1 - (x/h)^2 by its chords, within the columns."""
    share = np.linspace(-1.0, 1.0, _POINTS)[1:-1]
    return PiecewiseLinear(middle + column * share, 1 - share**2)
