"""Which designs a search tries: evolution of the searched numbers, each from 0 at its low to 1 at its high end.

By the covariance matrix adaptation of Hansen and Ostermeier, Evolutionary Computation 9(2), 2001.
"""

from collections.abc import Sequence

import numpy as np
from cmaes import CMA

from .problem import Searched

TOGETHER = 12  # designs of a generation: none is learnt from before all are judged
_WIDTH = 0.15  # of the ranges: how far about the start the first generation lies
_OF_WEIGHTS = 0.2  # of that for a network's: most of the first generation are stable loops, as the start is
_NARROW = 1e-3  # of the ranges: a generation within it has come to rest


class Sampler:
    """Asks for designs, and learns from the scores of a generation at a time, small ones being good.

    Where the population has come to rest, a new one starts about the best design so far.
    """

    def __init__(self, searched: Sequence[Searched], seed: int) -> None:
        self._searched, self._seed = searched, seed
        self._best = np.array([_share(number, number.start) for number in searched]), np.inf
        self._evolution = self._about_the_best()
        self._judged: list[tuple[np.ndarray, float]] = []

    def ask(self) -> np.ndarray:
        """A design as shares of the ranges [k]."""
        return self._evolution.ask()

    def values(self, shares: np.ndarray) -> dict[str, float]:
        """The numbers of a design by name, each in its unit."""
        every = zip(self._searched, shares.tolist(), strict=True)
        return {number.name: number.rounded(_value(number, share)) for number, share in every}

    def tell(self, shares: np.ndarray, score: float) -> None:
        """How good a design is that was asked for."""
        self._judged.append((shares, score))
        if score < self._best[1]:
            self._best = shares, score
        if len(self._judged) == TOGETHER:
            self._evolution.tell(self._judged)
            if np.ptp([shares for shares, _ in self._judged], axis=0).max() < _NARROW:
                self._evolution = self._about_the_best()
            self._judged = []

    def _about_the_best(self) -> CMA:
        self._seed += 1
        bounds = np.tile([0.0, 1.0], (len(self._searched), 1))
        shape = np.diag([_OF_WEIGHTS**2 if number.is_weight else 1.0 for number in self._searched])
        return CMA(self._best[0], _WIDTH, bounds=bounds, seed=self._seed, population_size=TOGETHER, cov=shape)


def _share(number: Searched, value: float) -> float:
    if number.log:
        return float(np.log(value / number.low) / np.log(number.high / number.low))
    return (value - number.low) / (number.high - number.low)


def _value(number: Searched, share: float) -> float:
    if number.log:
        return float(number.low * (number.high / number.low) ** share)
    return number.low + share * (number.high - number.low)
