"""The abstract controller of an error: second-order sections on reference less signal, whatever designed them."""

from collections.abc import Mapping
from typing import ClassVar

import control
import numpy as np

from .second_order_sections import SectionFilter, sections_system


class SectionController:
    """command = memory(ahead(reference - controlled signal)). A controller gives both, in __init__, as sections.

    `ahead` holds what is fast, `memory` what would wind up. Anti-windup: the memory takes in what would have led to
    the command that the drive really got (the conditioning technique of Hanus, Kinnaert, Henrotte, Automatica 23(6),
    1987), so its sections answer at once and have their zeros inside the unit circle. To put what is fast through the
    same would let a limit ring at its zeros.
    """

    measures: ClassVar[tuple[str, ...]] = ("position",)

    def __init__(self, ahead: np.ndarray, memory: np.ndarray, period: float) -> None:
        self._sections, self._period = np.vstack((ahead, memory)), period
        self._ahead, self._memory = SectionFilter(ahead), SectionFilter(memory)
        self._offset = self._error = self._shaped = self._demanded = 0.0

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the sections rest at this error, an offset keeps the command that the drive holds."""
        self._error = reference - measurement[self.measures[0]]
        self._ahead.rest(self._error)
        self._memory.rest(self._ahead.out(self._error))
        self._offset = 0.0
        self._offset = command - self.compute(reference, measurement)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The sections' answer to the error, and the command found at the start."""
        self._error = reference - measurement[self.measures[0]]
        self._shaped = self._ahead.out(self._error)
        self._demanded = self._memory.out(self._shaped) + self._offset
        return self._demanded

    def update(self, realised: float) -> None:
        """Advance both by one period, the memory to where the command that the drive really got leaves it."""
        self._ahead.advance(self._error)
        self._memory.advance(self._shaped + (realised - self._demanded) / self._memory.direct)

    def linear(self) -> control.StateSpace:
        """The sections on reference and, with the other sign, on the signal."""
        law = sections_system(self._sections, self._period)
        a, b, c, d = (np.asarray(part) for part in (law.A, law.B, law.C, law.D))
        names = {"inputs": ["reference", self.measures[0]], "outputs": ["command"]}
        return control.StateSpace(a, np.hstack((b, -b)), c, np.hstack((d, -d)), self._period, **names)
