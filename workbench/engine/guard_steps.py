"""The rules of the guard evaluated sample by sample, in CasADi's interpreter: fixed places, nothing is copied."""

from collections.abc import Mapping

import numpy as np

from .buffered import BufferedFunction
from .guard_rules import graphs
from .guard_shape import GuardShape


class GuardSteps:
    """A guard's state, stepped by `watch` and `limit`. `numbers` are those of `shape.numbers`, in its order."""

    def __init__(self, shape: GuardShape, numbers: np.ndarray) -> None:
        self._read, self._numbers = shape.read, np.array(numbers, float)
        self._trip, self._speed = shape.state["trip"].start, shape.state["v"].start
        watch, limit = graphs(shape)
        self._state = np.zeros(watch.numel_in(0))
        self._readings, self._command, self._demanded, self._reference = np.zeros(len(shape.read)), *np.zeros((3, 1))
        places = self._command, self._numbers
        self._watch = BufferedFunction(watch, self._state, self._readings, *places, self._reference)
        self._limit = BufferedFunction(limit, self._state, self._demanded, *places)

    def reset(self) -> None:
        """Forget the past."""
        self._state[:] = 0

    @property
    def speed(self) -> float:
        """The speed [m/s] that the readings say."""
        return float(self._state[self._speed])

    def watch(self, measurement: Mapping[str, float], command: float, reference: float) -> int:
        """Read the signals (SI, NaN where one is missing) while the drive holds a command, and the position should be
        at a reference, NaN: anywhere; the trip's number, or 0."""
        self._readings[:] = [measurement.get(name, np.nan) for name in self._read]
        self._command[0], self._reference[0] = command, reference
        self._watch.evaluate()
        self._state[:] = self._watch.found
        return int(self._state[self._trip])

    def limit(self, demanded: float, command: float) -> tuple[float, int]:
        """The command that the drive gets after `command`, and the number of the trip, or 0."""
        self._demanded[0], self._command[0] = demanded, command
        self._limit.evaluate()
        sent, trip = self._limit.found.tolist()
        self._state[self._trip] = trip
        return sent, int(trip)
