"""What holds numbers before any recording: their ranges, and that static curves bend little.

Every number is held loosely, by half its range, at distance 0. A curve of several coefficients is held straight by the
squares of its bends, each over a typical coefficient, times one `stiffness` (P-splines: Eilers, Marx, Statistical
Science 11(2), 1996): without it coefficients that recordings hardly tell apart would go from bound to bound.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .determined import FreeParameter
from .normal_equations import ranges

STIFFNESSES = tuple(10.0**power for power in range(-1, 7))
STIFFEST = STIFFNESSES[-1]


@dataclass(frozen=True, eq=False)
class Prior:
    """Ranges `low`, `high` and half their `width` [k], as distances; bends of curves, `rows` @ x + `offsets` [m]."""

    low: np.ndarray
    high: np.ndarray
    width: np.ndarray
    rows: np.ndarray
    offsets: np.ndarray
    stiffness: float = 0.0

    @property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Both ends of the ranges."""
        return self.low, self.high

    @property
    def bends(self) -> bool:
        """Whether there is a curve that could bend."""
        return self.offsets.size > 0

    @cached_property
    def matrix(self) -> np.ndarray:
        """The second derivative of the cost, [k, k]."""
        return np.diag(self.width**-2) + self.stiffness * self.rows.T @ self.rows

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Half the slope of the cost at distances x, [k]."""
        return x / self.width**2 + self.stiffness * self.rows.T @ (self.rows @ x + self.offsets)

    def cost(self, x: np.ndarray) -> float:
        """What the distances x cost."""
        return float(np.sum((x / self.width) ** 2) + self.stiffness * np.sum((self.rows @ x + self.offsets) ** 2))

    def at(self, stiffness: float) -> "Prior":
        """This prior with curves of another stiffness."""
        return replace(self, stiffness=stiffness)


def prior_of(
    free: Sequence[FreeParameter], bends: Sequence[Mapping[str, float]] = (), values: Mapping[str, float] | None = None
) -> Prior:
    """The prior of free numbers, with the bends of a plant's curves; numbers that are not free have `values` [SI]."""
    low, high, width = ranges(free)
    places = {f.name: place for place, f in enumerate(free)}
    rows, offsets = [], []
    for bend in bends:
        own = {name: free[places[name]] for name in bend if name in places}
        scales = {name: f.scale for name, f in own.items() if f.scale is not None}
        if len(scales) < len(own) or not own:  # a curve of which a number is searched by its logarithm has no such sum
            continue
        row = np.zeros(len(free))
        row[[places[name] for name in own]] = [bend[name] * scales[name] for name in own]
        rows.append(row)
        offsets.append(sum(weight * (own[n].start if n in own else (values or {})[n]) for n, weight in bend.items()))
    return Prior(low, high, width, np.reshape(rows, (-1, len(free))), np.array(offsets, float))
