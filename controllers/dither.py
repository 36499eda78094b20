"""Dither: a fast sine on the command, which keeps a valve from sticking."""

from typing import ClassVar, Literal

from workbench.base.errors import InputError
from workbench.control.protocol import design_numbers, number
from workbench.control.shells import SineShell

_MOST = 0.3  # of the sampling frequency: a sine of fewer samples a period is no sine


class Dither:
    """The command with a sine on top, from 0 at the start.

    A torque motor with hysteresis and a spool with friction answer a small command only beyond a threshold. A sine
    beyond that threshold, too fast for the load to follow, leaves them linear on average (Merritt, Hydraulic Control
    Systems, 1967, ch. 10; Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, sec. 4: dither). The law
    learns the realised command without it, and no margin sees it. Name it last. Raises InputError for a frequency above
    0.3 of the sampling frequency.
    """

    into: ClassVar[Literal["dither"]] = "dither"

    @design_numbers
    class Design:
        """Design numbers."""

        amplitude: float = number("1", 0.0, 0.5, "of the command")
        frequency: float = number("Hz", 1.0, 1e4, "far above what the load follows")

    def __init__(self, design: Design, period: float) -> None:
        if design.frequency * period > _MOST:
            raise InputError(
                f"Dither: frequency {design.frequency:g} Hz: must be at most {_MOST / period:g} Hz at this rate"
            )
        self.shell = SineShell(design.amplitude, design.frequency, period)
