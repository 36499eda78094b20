"""The abstract controller of an error: second-order sections on reference less signal, whatever designed them."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..linear.state_space import StateSpace, of_sum
from .linear_law import LinearLaw
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
        self._memory_sections = len(memory)
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

    def linear_law(self) -> LinearLaw:
        """The law as data; the memory's realised-command form is (Am - Bm Cm/Dm) x + Bm/Dm (v - o)."""
        split = len(self._sections) - self._memory_sections
        (aa, ba, ca, da), (am, bm, cm, dm) = (
            [np.asarray(part) for part in (law.A, law.B, law.C, law.D)]
            for law in (sections_system(part, self._period) for part in np.split(self._sections, [split]))
        )
        direct, k = float(dm[0, 0]), len(aa)
        a = np.block([[aa, np.zeros((k, len(am)))], [np.zeros((len(am), k)), am - bm @ cm / direct]])
        b, both = np.append(ba[:, 0], np.zeros(len(am))), np.array([1.0, -1.0])
        c, d, e = (
            np.append(direct * ca[0], cm[0]),
            float(dm[0, 0] * da[0, 0]),
            np.append(np.zeros(k), bm[:, 0] / direct),
        )
        ahead, memory = SectionFilter(self._sections[:split]), SectionFilter(self._sections[split:])

        def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
            error = float(signals[0] - signals[1])
            ahead.rest(error)
            memory.rest(ahead.out(error))
            x = np.concatenate((ahead.state, memory.state))
            return x, float(command - c @ x - d * error)

        return LinearLaw(a, np.outer(b, both), c, d * both, e, self.measures, start)

    def linear(self) -> StateSpace:
        """The sections on reference and, with the other sign, on the signal."""
        law = of_sum(sections_system(self._sections, self._period), {"reference": 1.0, self.measures[0]: -1.0})
        return law.relabelled(law.input_labels, ["command"])
