"""What a few figures determine of many numbers: combinations that they fix, and how well each number is known alone."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

_FURTHEST = 700.0  # of a normalised distance: no double has its exponential beyond
FIGURE_ERROR = 0.02  # of a figure that is read off a datasheet's curve, one standard deviation
DETERMINED = 0.10  # a number or combination that is known better than this (95 %) is determined


@dataclass(frozen=True)
class FreeParameter:
    """A number that a fit may move, SI.

    `scale` is the change that counts as 1; None: changes are relative. `printed`: a published number that moves inside
    its rounding, or a friction that may be there: no unknown of its own. `reason` says where the estimate is from.
    """

    name: str
    start: float
    low: float
    high: float
    scale: float | None
    reason: str
    printed: bool = False

    def value(self, x: float) -> float:
        """SI value at a normalised distance x from the estimate."""
        if self.scale is not None:
            return self.start + self.scale * x
        return self.start * float(np.exp(np.clip(x, -_FURTHEST, _FURTHEST)))

    def normalised(self, value: float) -> float:
        """The normalised distance x of a value from the estimate."""
        return float(np.log(value / self.start)) if self.scale is None else (value - self.start) / self.scale

    @property
    def width(self) -> float:
        """Half the range, as a distance."""
        return (self.normalised(self.high) - self.normalised(self.low)) / 2


@dataclass(frozen=True)
class Combination:
    """A combination of numbers, the weights of their changes, and its 95 % interval (half its width)."""

    weights: Mapping[str, float]
    interval: float

    @property
    def determined(self) -> bool:
        """Whether the figures determine it."""
        return self.interval < DETERMINED


@dataclass(frozen=True)
class Determination:
    """What the figures determine: `combinations` of the unknowns, best first; 95 % half intervals of single numbers.

    `marginal` is known whatever the others are, `conditional` when all others are known; both normalised.
    """

    combinations: tuple[Combination, ...]
    marginal: Mapping[str, float]
    conditional: Mapping[str, float]

    @property
    def count(self) -> int:
        """Number of determined combinations."""
        return sum(combination.determined for combination in self.combinations)


def determine(slopes: np.ndarray, free: tuple[FreeParameter, ...]) -> Determination:
    """What figures known to 2 % determine, from the slopes [figures, free] of their logarithms over the distances.

    Combinations of the unknowns: singular vectors of the slopes over the figures' errors, to which the printed
    numbers' rounding adds (uniform over its range). Single numbers: with all ranges as prior knowledge.
    """
    prior = np.array([f.width for f in free]) / np.sqrt(3)
    own = np.array([not f.printed for f in free])
    rounding = slopes[:, ~own] * prior[~own]
    noise = np.linalg.cholesky(FIGURE_ERROR**2 * np.eye(len(slopes)) + rounding @ rounding.T)
    _, sizes, vectors = np.linalg.svd(np.linalg.solve(noise, slopes[:, own]))
    sizes = np.concatenate([sizes, np.zeros(len(vectors) - len(sizes))])
    names = [f.name for f in free if not f.printed]
    combinations = tuple(
        Combination(dict(zip(names, (vector * np.sign(vector[np.argmax(np.abs(vector))])).tolist(), strict=True)), size)
        for vector, size in zip(vectors, (1.96 / np.maximum(sizes, 1e-9)).tolist(), strict=True)
    )
    information = slopes.T @ slopes / FIGURE_ERROR**2 + np.diag(prior**-2)
    marginal, given = np.sqrt(np.diag(np.linalg.inv(information))), np.diag(information) ** -0.5
    every = [f.name for f in free]
    return Determination(
        combinations,
        dict(zip(every, (1.96 * marginal).tolist(), strict=True)),
        dict(zip(every, (1.96 * given).tolist(), strict=True)),
    )
