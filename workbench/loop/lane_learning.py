"""Iterative learning on many plants at once: every lane corrects a drive of its own, by one filter."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .learning import LearningFilter, stops
from .repeated_lanes import PlayedLanes

Play = Callable[[int, np.ndarray, np.ndarray], PlayedLanes]


@dataclass(frozen=True, eq=False)
class LanesLearned:
    """RMS of the measured error [lanes, 1 + n]: of the record itself and of n iterations, NaN where there was none.

    kept [lanes, 1 + n]: from which the next one went on. tripped [lanes, 1 + n]. floor [lanes]: RMS of what does not
    repeat. stopped [lanes]: places in STOPS, 0 of a lane that took all of its iterations or whose record trips.
    """

    errors: np.ndarray
    kept: np.ndarray
    tripped: np.ndarray
    floor: np.ndarray
    stopped: np.ndarray

    @property
    def fall_db(self) -> np.ndarray:
        """By how much the RMS of the error fell [lanes], dB; 0 on a plant whose record trips."""
        best = np.where(self.kept, self.errors, np.inf).min(axis=1)
        return np.where(self.tripped[:, 0], 0.0, 20 * np.log10(self.errors[:, 0] / best))

    @property
    def taken_back(self) -> np.ndarray:
        """Which lanes had an iteration that made the error larger or tripped [lanes]."""
        played = (self.errors > 0) | self.tripped
        return np.any((played & ~self.kept)[:, 1:], axis=1)


def learn_lanes(learning: LearningFilter, reference: np.ndarray, play: Play, lanes: int, most: int) -> LanesLearned:
    """What `learn` does on every plant by itself: a drive for a reference [samples], in at most so many iterations.

    `play` plays the nth drives [n, samples] on some of the lanes [n].
    """
    every, drives = np.arange(lanes), np.tile(reference, (lanes, 1))
    first, again = (play(number, drives, every) for number in (0, -1))
    errors, kept, tripped = np.full((lanes, 1 + most), np.nan), *np.zeros((2, lanes, 1 + most), bool)
    left, floor = reference - first.measured, _rms(first.measured - again.measured) / np.sqrt(2)
    errors[:, 0], kept[:, 0], tripped[:, 0] = _rms(left), True, first.tripped
    best, gain, change = errors[:, 0].copy(), np.ones(lanes), np.full(lanes, np.nan)
    for number in range(1, most + 1):
        running = every[(stops(best, floor, gain, change) == 0) & ~first.tripped]
        if not len(running):
            break
        proposed = learning.corrected(drives[running], left[running], gain[running, None])
        played = play(number, proposed, running)
        rest = reference - played.measured
        error = _rms(rest)
        better = ~played.tripped & (error <= best[running])
        errors[running, number], kept[running, number], tripped[running, number] = error, better, played.tripped
        change[running] = np.where(played.tripped, np.nan, 20 * np.log10(error / best[running]))
        gain[running] /= np.where(better, 1, 2)
        took = running[better]
        drives[took], left[took], best[took] = proposed[better], rest[better], error[better]
    return LanesLearned(errors, kept, tripped, floor, np.where(first.tripped, 0, stops(best, floor, gain, change)))


def _rms(values: np.ndarray) -> np.ndarray:
    """Root of the mean square [lanes] of values [lanes, k]."""
    return np.sqrt(np.mean(values**2, axis=1))
