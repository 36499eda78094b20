"""Linear filters sampled for a controller: stepped sample by sample, and seen as discrete state spaces."""

from collections.abc import Mapping, Sequence
from typing import cast

import control
import numpy as np


class Filter:
    """A stable discrete filter with one output: y = C x + D u, then x = A x + B u, u [m] in the order of its inputs."""

    def __init__(self, law: control.StateSpace) -> None:
        self.law = law
        self._a, self._b = np.asarray(law.A), np.asarray(law.B)
        self._c, self._d = np.asarray(law.C)[0], np.asarray(law.D)[0]
        self._x = np.zeros(len(self._a))

    def rest(self, u: Sequence[float]) -> None:
        """Take the state that stays as it is under a constant input."""
        self._x = np.linalg.solve(np.eye(len(self._a)) - self._a, self._b @ np.asarray(u))

    def out(self, u: Sequence[float]) -> float:
        """The output now; changes nothing."""
        return float(self._c @ self._x + self._d @ np.asarray(u))

    def ahead(self, future: np.ndarray) -> np.ndarray:
        """The outputs [k] that a course of the one input [k] will have from now on; changes nothing."""
        x, found = self._x, np.empty(len(future))
        for i, u in enumerate(future):
            found[i] = self._c @ x + self._d[0] * u
            x = self._a @ x + self._b[:, 0] * u
        return found

    def step(self, u: Sequence[float]) -> None:
        """Go on by one sample."""
        self._x = self._a @ self._x + self._b @ np.asarray(u)


def weighted(
    numerator: Sequence[float], denominator: Sequence[float], period: float, inputs: Mapping[str, float]
) -> control.StateSpace:
    """numerator(s)/denominator(s), highest power first, by Tustin's rule at `period` [s], of a weighted sum of inputs.

    `inputs` gives each signal's weight; the output is called "out". Raises ValueError for more zeros than poles.
    """
    weights = np.array([list(inputs.values())])
    sampled = cast(control.StateSpace, control.tf2ss(control.tf(numerator, denominator))).sample(period, "tustin")
    a, b, c, d = (np.asarray(part) for part in (sampled.A, sampled.B, sampled.C, sampled.D))
    return control.StateSpace(a, b @ weights, c, d @ weights, period, inputs=list(inputs), outputs=["out"])
