"""A sine on top of a controller's command: the law as data, sample by sample, and as a graph."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..linear.state_space import StateSpace
from .around import Around
from .protocol import Controller, linear_view, scheduled_law
from .scheduled_law import ScheduledLaw

if TYPE_CHECKING:
    from .graph_law import GraphLaw


@dataclass(frozen=True)
class Sine:
    """amplitude [1] x sin(2 pi frequency [Hz] t), sampled every period [s], by a turn from sample to sample."""

    amplitude: float
    frequency: float
    period: float

    @property
    def turn(self) -> np.ndarray:
        """What takes (sine, cosine) to the next sample [2, 2]."""
        angle = 2 * np.pi * self.frequency * self.period
        return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

    def samples(self, count: int) -> np.ndarray:
        """The first so many of it."""
        state, turn, out = np.array([0.0, self.amplitude]), self.turn, np.empty(count)
        for k in range(count):
            out[k], state = state[0], turn @ state
        return out


class Dithered(Around):
    """A controller with a sine on top of its command, itself a controller; it learns the realised command less that.

    Its linear view is that of the controller: the sine comes from nowhere.
    """

    def __init__(self, inner: Controller, sine: Sine) -> None:
        super().__init__(inner)
        self._sine, self._turn, self.measures = sine, sine.turn, inner.measures
        self._state = np.zeros(2)

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the sine begins at 0."""
        self._state = np.array([0.0, self._sine.amplitude])
        self._inner.reset(reference, measurement, command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command and the sine."""
        return self._inner.compute(reference, measurement) + float(self._state[0])

    def update(self, realised: float) -> None:
        """Advance both by one period."""
        self._inner.update(realised - float(self._state[0]))
        self._state = self._turn @ self._state

    def graph_law(self) -> "GraphLaw | None":
        """Both together as a graph, where the inner controller has data or a graph."""
        return self._graph

    def _graph_around(self, inner: "GraphLaw") -> "GraphLaw":
        from .graph_law import with_sine

        return with_sine(inner, self._sine.amplitude, self._turn)

    def scheduled_law(self) -> ScheduledLaw:
        """The inner controller's with the sine on top; raises InputError where there is none."""
        return scheduled_law(self._inner).with_sine(self._sine)

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The inner controller's."""
        return linear_view(self._inner, at)
