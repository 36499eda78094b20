"""Piecewise linear functions of one variable: schedules of a gain, and static maps of the command."""

from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..engine import lazy_casadi as ca


@dataclass(frozen=True, eq=False)
class PiecewiseLinear:
    """`values` [k] at increasing points `at` [k], linear between them, held beyond. Raises InputError."""

    at: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        if not (self.at.shape == self.values.shape and len(self.at) > 1 and np.all(np.diff(self.at) > 0)):
            raise InputError("a table needs two points or more, in increasing order, with a value each")

    def __call__(self, x: float) -> float:
        """The value at x."""
        return float(np.interp(x, self.at, self.values))

    def over(self, x: np.ndarray) -> np.ndarray:
        """The values at x [k]."""
        return np.interp(x, self.at, self.values)

    def slope(self, x: float) -> float:
        """The slope at x, to the right of it at a point; 0 beyond the ends."""
        i = int(np.searchsorted(self.at, x, side="right")) - 1
        if not 0 <= i < len(self.at) - 1:
            return 0.0
        return float((self.values[i + 1] - self.values[i]) / (self.at[i + 1] - self.at[i]))


@dataclass(frozen=True, eq=False)
class CommandMap:
    """A static map of a command: `at` [k] goes to `to` [k], both increasing, unchanged beyond the ends.

    The ends go to themselves. Raises InputError.
    """

    at: np.ndarray
    to: np.ndarray

    def __post_init__(self) -> None:
        if self.at[0] != self.to[0] or self.at[-1] != self.to[-1] or not np.all(np.diff(self.to) > 0):
            raise InputError("a map of the command must increase, and its ends must go to themselves")

    @property
    def shift(self) -> PiecewiseLinear:
        """What is added to a command."""
        return PiecewiseLinear(self.at, self.to - self.at)

    @property
    def back(self) -> PiecewiseLinear:
        """What is added to a mapped command to have the command again."""
        return PiecewiseLinear(self.to, self.at - self.to)


def interpolated(at: "ca.SX", values: "ca.SX", x: "ca.SX") -> "ca.SX":
    """Values [k] at increasing points [k], linear between them, held beyond: as PiecewiseLinear.

    A sum of bends, so that the slope at a point is that of one of its sides: rounding decides at most which.
    """
    slopes = (values[1:] - values[:-1]) / (at[1:] - at[:-1])
    bends = ca.vertcat(slopes, 0) - ca.vertcat(0, slopes)
    return values[0] + ca.dot(bends, ca.fmax(x - at, 0))
