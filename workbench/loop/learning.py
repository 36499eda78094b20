"""Iterative learning of a drive file: what a loop is given to follow, corrected by what it left of the error.

After each time that the same record is played, the drive u becomes u + g (Q (u + L e) - u): e is the error, L the
inverse of the closed loop T, Q a low pass of no phase, g the gain, 1 unless an iteration made the error larger. Errors
shrink by |Q (1 - L T)| at each frequency (Bristow, Tharayil and Alleyne, A survey of iterative learning control, IEEE
Control Systems Magazine 26(3), 2006); with a smaller gain the drive that it arrives at is the same. On many plants at
once every lane corrects a drive of its own, by one filter.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

STEEPNESS = 4  # order of Q, whose gain is 1/(1 + (f/cut-off)^8)
BOUND = 0.9  # of |Q (1 - L T)| on every plant
FAINT = 0.03  # of a closed loop's gain: L does not invert what is fainter, where it would answer to noise alone
FALL = 1.0  # dB: an iteration by which the error falls, but by less, is the last
LEAST_GAIN = 0.25
CUTOFFS = 400  # tried, over all frequencies
LOWEST = 0.1  # Hz
STOPS = (
    "",
    "what is left of the error does not repeat",
    "a smaller gain makes the error no smaller",
    f"the error falls by less than {FALL:g} dB",
)


@dataclass(frozen=True, eq=False)
class LearningFilter:
    """L and Q on the frequencies f [k] Hz of a record of `samples` with its padding: inverse complex [k], q [k] real.

    `cutoff` [Hz] is that of Q.
    """

    f: np.ndarray
    inverse: np.ndarray
    q: np.ndarray
    cutoff: float
    samples: int

    def corrected(self, drive: np.ndarray, error: np.ndarray, gain: float | np.ndarray = 1.0) -> np.ndarray:
        """The next drives [.., samples] from the last ones and the errors that they left; `gain` may be [.., 1]."""
        proposed = self._filtered(self.q, drive) + self._filtered(self.q * self.inverse, error)
        return drive + gain * (proposed - drive)

    def contraction(self, response: np.ndarray) -> np.ndarray:
        """|Q (1 - L T)| [.., k] of closed loops T, complex [.., k] at f."""
        return np.abs(self.q * (1 - self.inverse * response))

    def _filtered(self, gains: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Values [.., samples] through gains [k]."""
        return from_spectrum(gains * spectrum(values, len(self.f)), self.samples)


def spectrum(values: np.ndarray, lines: int) -> np.ndarray:
    """Spectra [.., lines] of values [.., samples], padded by a line from their end back to their start."""
    whole = 2 * (lines - 1)
    back = np.linspace(values[..., -1], values[..., 0], whole - values.shape[-1] + 2, axis=-1)[..., 1:-1]
    return np.fft.rfft(np.concatenate((values, back), axis=-1))


def from_spectrum(lines: np.ndarray, samples: int) -> np.ndarray:
    """The first values [.., samples] of such spectra [.., k]."""
    return np.fft.irfft(lines, 2 * (lines.shape[-1] - 1))[..., :samples]


class Corrector(Protocol):
    """What makes the next drive of the last one and of the error that it left."""

    def corrected(self, drive: np.ndarray, error: np.ndarray, gain: float = 1.0) -> np.ndarray:
        """The next drive; a smaller gain goes a part of the way."""
        ...


def record_frequencies(samples: int, period: float) -> np.ndarray:
    """Frequencies [k] Hz of a record of so many samples with padding of at least as many."""
    return np.fft.rfftfreq(2 ** int(np.ceil(np.log2(2 * samples))), period)


def learning_filter(
    f: np.ndarray, samples: int, design: np.ndarray, plants: np.ndarray, highest: float
) -> LearningFilter:
    """L is the inverse of closed loops `design`, complex [n, k] at f: the least squares of 1 - L T over them.

    Q has the highest cut-off, up to `highest` [Hz], with which |Q (1 - L T)| stays below 0.9 on all `plants` [m, k].
    """
    inverse = np.mean(design.conj(), axis=0) / (np.mean(np.abs(design) ** 2, axis=0) + FAINT**2)
    left = np.abs(1 - inverse * plants).max(axis=0)
    cutoffs = np.geomspace(highest, LOWEST, CUTOFFS)
    converge = (cutoff for cutoff in cutoffs if (low_pass(f, cutoff) * left).max() < BOUND)
    cutoff = float(next(converge, LOWEST))
    return LearningFilter(f, inverse, low_pass(f, cutoff), cutoff, samples)


def low_pass(f: np.ndarray, cutoff: float) -> np.ndarray:
    """Gains [k] of Q at f [k] Hz."""
    return 1 / (1 + (f / cutoff) ** (2 * STEEPNESS))


@dataclass(frozen=True, eq=False)
class Iteration:
    """One time that the record was played: drive, what the controlled signal did and its sensor said, command [k] or
    [k, axes].

    `chambers`: what a row says of them. `kept`: whether the next iteration goes on from it; `gain` is that by which
    its drive was corrected.
    """

    drive: np.ndarray
    true: np.ndarray
    measured: np.ndarray
    command: np.ndarray
    saturated: float
    chambers: Mapping[str, float | None]
    tripped: str | None
    gain: float = 1.0
    kept: bool = True


@dataclass(frozen=True, eq=False)
class Learned:
    """All iterations in which a drive was learned for a `reference` [k], the RMS `floor` of what does not repeat, and
    why it stopped."""

    reference: np.ndarray
    iterations: tuple[Iteration, ...]
    floor: float
    stopped: str

    @property
    def best(self) -> Iteration:
        """The last one that was kept."""
        return [iteration for iteration in self.iterations if iteration.kept][-1]

    def error(self, iteration: Iteration) -> float:
        """RMS of the measured error of an iteration."""
        return rms(self.reference[: len(iteration.measured)] - iteration.measured)

    @property
    def fall_db(self) -> float:
        """By how much the RMS of the error fell [dB]."""
        return float(20 * np.log10(self.error(self.iterations[0]) / self.error(self.best)))


def rms(values: np.ndarray) -> float:
    """Root of the mean square of values [..]."""
    return float(np.sqrt(np.mean(values**2)))


def stops(
    best: np.ndarray | float, floor: np.ndarray | float, gain: np.ndarray | float, change_db: np.ndarray | float
) -> np.ndarray:
    """Places in STOPS [..]: why there is nothing more to learn, 0 where there is.

    Of the RMS error of the `best` iteration and of what does not repeat, the gain of the next one, and by how much
    the last one changed the error; NaN where it tripped, or is the first.
    """
    at_floor, weak, fall = best <= floor * 10 ** (FALL / 20), np.asarray(gain) < LEAST_GAIN, -np.asarray(change_db)
    return np.select([at_floor, weak, (fall >= 0) & (fall < FALL)], [1, 2, 3], 0)


def learn(
    learning: Corrector, reference: np.ndarray, play: Callable[[int, np.ndarray, float], Iteration], most: int
) -> Learned:
    """Learn a drive for a reference [samples] or [samples, axes], in deviations from the start; `play` plays the nth
    drive at a gain.

    The reference itself is played twice first: half the variance of the difference is what does not repeat. An
    iteration that trips or makes the error larger is taken back, and the gain halved.
    """
    first, again = play(0, reference, 1.0), play(-1, reference, 1.0)
    learned = Learned(reference, (first,), rms(first.measured - again.measured) / np.sqrt(2), "")
    if first.tripped:
        return replace(learned, stopped=f"the record itself trips the guard: {first.tripped}")
    best, least, gain, change = first, learned.error(first), 1.0, np.nan
    for number in range(1, most + 1):
        if stopped := STOPS[int(stops(least, learned.floor, gain, change))]:
            return replace(learned, stopped=stopped)
        iteration = play(number, learning.corrected(best.drive, reference - best.measured, gain), gain)
        error = learned.error(iteration)
        kept = iteration.tripped is None and error <= least
        change = 20 * np.log10(error / least) if iteration.tripped is None else np.nan
        learned = replace(learned, iterations=(*learned.iterations, replace(iteration, kept=kept)))
        best, least, gain = (iteration, error, gain) if kept else (best, least, gain / 2)
    return replace(learned, stopped=STOPS[int(stops(least, learned.floor, gain, change))] or f"{most} iterations")


@dataclass(frozen=True, eq=False)
class PlayedLanes:
    """What the controlled signal did and what its sensor said [lanes, k], from the start; which lanes tripped [lanes].

    A lane that could not be simulated counts as tripped.
    """

    true: np.ndarray
    measured: np.ndarray
    tripped: np.ndarray


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


Play = Callable[[int, np.ndarray, np.ndarray], PlayedLanes]


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
