"""Linear filters sampled for a controller: stepped sample by sample, and seen as discrete state spaces."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..linear.state_space import StateSpace, as_state_space, of_sum, transfer_function, tustin

if TYPE_CHECKING:
    import control


class Filter:
    """A stable discrete filter with one output: y = C x + D u, then x = A x + B u, u [m] in the order of its inputs.

    In lanes u is [m, lanes], `outputs` takes the place of `out`, and a course is [k, lanes].
    """

    def __init__(self, law: "StateSpace | control.StateSpace") -> None:
        self.law = as_state_space(law)
        self._a, self._b, self._c, self._d = self.law.A, self.law.B, self.law.C[0], self.law.D[0]
        self._x = np.zeros(len(self._a))

    def rest(self, u: Sequence[float] | np.ndarray) -> None:
        """Take the state that stays as it is under a constant input."""
        self._x = np.linalg.solve(np.eye(len(self._a)) - self._a, self._b @ np.asarray(u))

    def out(self, u: Sequence[float]) -> float:
        """The output now; changes nothing."""
        return float(self._c @ self._x + self._d @ np.asarray(u))

    def outputs(self, u: np.ndarray) -> np.ndarray:
        """The outputs [lanes] now; changes nothing."""
        return self._c @ self._x + self._d @ u

    def ahead(self, future: np.ndarray) -> np.ndarray:
        """The outputs [k] that a course of the one input [k] will have from now on; changes nothing."""
        x, outputs = self._x, np.empty_like(future)
        for i, u in enumerate(future):
            outputs[i] = self._c @ x + self._d[0] * u
            x = self._a @ x + np.multiply.outer(self._b[:, 0], u)
        return outputs

    def step(self, u: Sequence[float] | np.ndarray) -> None:
        """Go on by one sample."""
        self._x = self._a @ self._x + self._b @ np.asarray(u)


def weighted(
    numerator: Sequence[float], denominator: Sequence[float], period: float, inputs: Mapping[str, float]
) -> StateSpace:
    """numerator(s)/denominator(s), highest power first, by Tustin's rule at `period` [s], of a weighted sum of inputs.

    `inputs` gives each signal's weight; the output is called "out". Raises ValueError for more zeros than poles.
    """
    sampled = tustin(transfer_function(numerator, denominator), period)
    return of_sum(StateSpace(*sampled, period, ["in"], ["out"]), inputs)
