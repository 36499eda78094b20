"""A lag on the force error: what leakage costs a force loop is made up slowly."""

from typing import ClassVar, Literal

from workbench.control.compensators import weighted
from workbench.control.protocol import design_numbers, number


class ForceLag:
    """u += K/(T s + 1) (r - F/k): an integral that forgets over T, of the deflection r that a force loop is short of.

    A jack that holds a force leaks, and its force sinks with a time constant in proportion to one over the specimen's
    stiffness. The flow that makes up for it goes with the force, whatever specimen makes it: so this stands outside of
    what scales a loop by the specimen.
    """

    into: ClassVar[Literal["command", "reference"]] = "command"

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/m", 0.0, 1e4, "command per deflection at rest K")
        time: float = number("s", 1e-2, 1e3, "time constant T")
        stiffness: float = number("N/m", 1e3, 1e10, "of the specimen whose deflection the reference is k")

    def __init__(self, design: Design, period: float) -> None:
        weights = {"reference": design.gain, "force": -design.gain / design.stiffness}
        self.law = weighted([1], [design.time, 1], period, weights)
