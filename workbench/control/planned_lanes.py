"""A predictive law in lanes that compute in Python: those with a preview, which a compiled loop does not give."""

from collections.abc import Mapping

import numpy as np

from ..engine.kernel import Kernel
from .planned_law import PlannedLaw


class PlannedLanes:
    """The law's kernel on one lane after another."""

    def __init__(self, planned: PlannedLaw, kernel: Kernel) -> None:
        self._planned, self._kernel = planned, kernel
        self.preview = planned.feedforward.shape[1] - 1

    def reset(self, reference: np.ndarray, measurement: Mapping[str, np.ndarray], command: np.ndarray) -> None:
        """Start without a bump: the filters see plants at rest, whose drives need the commands that they hold."""
        self._state = self._planned.start(measurement, reference, command)
        self._asked, self._sent = reference, command
        self._future: np.ndarray | None = None

    def set_preview(self, future: np.ndarray) -> None:
        """The references now and over the next samples [preview + 1, lanes], before each `compute`."""
        self._future = future

    def compute(self, reference: np.ndarray, measurement: Mapping[str, np.ndarray]) -> np.ndarray:
        """The laws on what the filters make of these signals, and the first changes of the plans."""
        signals = [measurement[name] for name in self._planned.observer.measures]
        future = np.tile(reference, (self.preview + 1, 1)) if self._future is None else self._future
        given = np.vstack((self._state, self._asked, self._sent, *signals, future)).T
        self._found = np.array([self._kernel(lane).copy() for lane in given])
        return self._found[:, 0]

    def update(self, realised: np.ndarray) -> None:
        """Predict the next period with the commands that the drives really got."""
        self._asked, self._sent = self._found[:, 2], realised
        self._state = self._found[:, 3:].T + np.multiply.outer(self._planned.observer.entering, realised)

    def stop(self, lanes: np.ndarray) -> None:
        """Nothing that has to end."""
