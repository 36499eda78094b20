"""The reference, written as the command: for a rig whose inner loop follows it."""

from typing import ClassVar

from workbench.control.law import LawController, static_law
from workbench.control.protocol import design_numbers, number


class Through(LawController):
    """u = K r. With K one over the full command of the rig's inner loop, that loop is asked for the reference itself.

    What is put around it, such as an inverse, learning or the amplitudes of sines, changes what the loop is asked.
    """

    measures: ClassVar[tuple[str, ...]] = ("position",)

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/m", 1e-3, 1e5, "command per reference")

    def __init__(self, design: Design, period: float) -> None:
        super().__init__(static_law([design.gain, 0.0], self.measures, period))
