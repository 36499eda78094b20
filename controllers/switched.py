"""Change over between loops, such as position and force, while they run and without a bump."""

from collections.abc import Mapping

import numpy as np

from workbench.control.protocol import Controller, linear_view
from workbench.linear.interconnect import select
from workbench.linear.state_space import StateSpace


class Switched:
    """Several controllers by name, one of which has the jack; `select` hands it to another.

    In the first period after a change the command is the one that the drive had, exactly. The new controller starts at
    the signals that it finds, as if they were asked for, with the command that the loop started at. What its own first
    command lacks of the drive's is added to it, and fades with the time constant `fade` [s], so that the change costs
    at most period/fade of that difference in a period. The reference is in the unit of the controller in charge.
    """

    def __init__(self, controllers: Mapping[str, Controller], first: str, fade: float, period: float) -> None:
        self._controllers, self._active = dict(controllers), controllers[first]
        self._keep = float(np.exp(-period / fade))
        self._asked, self._measured = 0.0, dict.fromkeys(self.measures, 0.0)
        self._standing = self._held = self._added = 0.0
        self._taking_over = False

    @property
    def measures(self) -> tuple[str, ...]:
        """What the controller in charge measures, then what the others need as well."""
        others = (name for other in self._controllers.values() for name in other.measures)
        return tuple(dict.fromkeys((*self._active.measures, *others)))

    def select(self, name: str) -> None:
        """Hand the jack to another controller, at the signals of the last period; KeyError for an unknown one."""
        self._active, self._taking_over = self._controllers[name], True
        self._active.reset(self._measured[self._active.measures[0]], self._measured, self._standing)

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump with the controller in charge."""
        self._asked, self._measured = reference, dict(measurement)
        self._standing = self._held = command
        self._added, self._taking_over = 0.0, False
        self._active.reset(reference, measurement, command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The command of the controller in charge and what fades; at a change, the command that the drive has."""
        self._asked, self._measured = reference, dict(measurement)
        return self._held if self._taking_over else self._active.compute(reference, measurement) + self._added

    def update(self, realised: float) -> None:
        """Advance the controller in charge; it learns the command less what was added."""
        if self._taking_over:
            self._added = realised - self._active.compute(self._asked, self._measured)
            self._taking_over = False
        self._active.update(realised - self._added)
        self._added *= self._keep
        self._held = realised

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The law of the controller in charge; what only the others measure has no part in it."""
        return select(linear_view(self._active, at), ["reference", *self.measures], ["command"])
