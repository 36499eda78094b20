"""An inverse of the lap: the flow at small commands made what it is at large ones."""

from typing import ClassVar, Literal

import numpy as np

from workbench.base.errors import InputError
from workbench.control.piecewise_linear import CommandMap
from workbench.control.protocol import design_numbers, number

_POINTS = 24  # of either side, even in the tanh


class LapInverse:
    """The command that gives, through flow ~ u + s tanh(u/w), the flow asked for.

    Lands that overlap the other way (underlap) let flow through on both sides of the spool's middle: the flow gain at
    null is 1 + s/w times that at large commands, 2 for a symmetric valve (Merritt, Hydraulic Control Systems, 1967, ch.
    5), and a loop that is stable at null is slow off it. The inverse takes that out, but for what the lap is not known.
    Lands that overlap let nothing through there: s is negative then, and the inverse jumps over a part -s of them.
    Commands beyond 1 stay as they are. Raises InputError for an overlap as wide as w, over which flow would fall.
    """

    into: ClassVar[Literal["command", "reference", "map"]] = "map"

    @design_numbers
    class Design:
        """Design numbers."""

        excess: float = number("1", -0.1, 0.1, "s: command by which the flow is ahead beyond the lap; negative: behind")
        width: float = number("1", 1e-6, 0.1, "w: command at which the lap ends")

    def __init__(self, design: Design, period: float) -> None:
        s, w = design.excess, design.width
        if s + w <= 0:
            raise InputError(f"LapInverse: excess {s:g}: its size must be below the width, {w:g}")
        inside = w * np.arctanh(np.linspace(0, 0.9995, _POINTS))
        command = np.concatenate((inside, [1.0]))
        flow = (command + s * np.tanh(command / w)) / (1 + s * np.tanh(1 / w))
        flow, command = (np.concatenate((-part[:0:-1], part)) for part in (flow, command))
        self.command_map = CommandMap(flow, command)
