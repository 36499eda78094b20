"""Proportional control: command = gain (reference - controlled signal)."""

from typing import ClassVar

from workbench.control.law import LawController, static_law
from workbench.control.protocol import design_numbers, number


class P(LawController):
    """u = K e on the position. The yardstick: a jack integrates, so it needs no more to arrive.

    A constant keeps the command that the drive holds at the start.
    """

    measures: ClassVar[tuple[str, ...]] = ("position",)

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/m", 1e-3, 1e3, "command per position error")

    def __init__(self, design: Design, period: float) -> None:
        super().__init__(static_law([design.gain, -design.gain], self.measures, period))
