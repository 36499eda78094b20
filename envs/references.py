"""The families that an episode's reference is drawn from: deviations of the controlled signal from its start."""

from dataclasses import dataclass
from typing import Annotated, Any, Protocol

import numpy as np


@dataclass(frozen=True)
class Range:
    """From where to where a number is drawn, SI."""

    low: float
    high: float

    def uniform(self, random: np.random.Generator, count: int | None = None) -> Any:
        """One number, or an array [count], evenly spread."""
        return self.low + (self.high - self.low) * random.random(count)

    def spread(self, random: np.random.Generator, count: int | None = None) -> Any:
        """Draws that are evenly spread over decades; both ends must be positive."""
        return self.low * (self.high / self.low) ** random.random(count)

    @property
    def largest(self) -> float:
        """The largest magnitude in it."""
        return max(abs(self.low), abs(self.high))


# units of a family's numbers: SI, with "signal" for that of what is controlled; only the first may be 0 or negative
Signal = Annotated[Range, "signal"]
SignalRate = Annotated[Range, "signal/s"]
Time = Annotated[Range, "s"]
Frequency = Annotated[Range, "Hz"]


class Family(Protocol):
    """A kind of reference. `size` bounds what it asks for, in the signal's SI unit."""

    @property
    def size(self) -> Range:
        """Levels, or the amplitude."""
        ...

    def make(self, random: np.random.Generator, t: np.ndarray) -> np.ndarray:
        """Deviations [k] at times t [k], in s from 0."""
        ...


@dataclass(frozen=True)
class Steps:
    """Levels of random size, each held for a random time; the first is there from the start."""

    size: Signal
    hold: Time

    def make(self, random: np.random.Generator, t: np.ndarray) -> np.ndarray:
        """See Family."""
        count = _pieces(t, self.hold)
        ends = np.cumsum(self.hold.uniform(random, count))
        return self.size.uniform(random, count + 1)[np.searchsorted(ends, t, side="right")]


@dataclass(frozen=True)
class Ramps:
    """From one random level to the next at a random rate, then held for a random time."""

    size: Signal
    rate: SignalRate
    hold: Time

    def make(self, random: np.random.Generator, t: np.ndarray) -> np.ndarray:
        """See Family."""
        count = _pieces(t, self.hold)
        levels = np.concatenate([[0.0], self.size.uniform(random, count)])
        slopes = np.abs(np.diff(levels)) / self.rate.uniform(random, count)
        pieces = np.stack([slopes, self.hold.uniform(random, count)], axis=1).ravel()
        return np.interp(t, np.concatenate([[0.0], np.cumsum(pieces)]), np.repeat(levels, 2)[1:])


@dataclass(frozen=True)
class Sines:
    """A sin(2 pi f t), A = size, f spread over decades."""

    size: Signal
    frequency: Frequency

    def make(self, random: np.random.Generator, t: np.ndarray) -> np.ndarray:
        """See Family."""
        return self.size.uniform(random) * np.sin(2 * np.pi * self.frequency.spread(random) * t)


@dataclass(frozen=True)
class Multisine:
    """(A/tones) sum of sin(2 pi f_i t + phase_i), A = size, f_i spread over decades; never beyond A."""

    size: Signal
    frequency: Frequency
    tones: int

    def make(self, random: np.random.Generator, t: np.ndarray) -> np.ndarray:
        """See Family."""
        size = self.size.uniform(random) / self.tones
        phases = 2 * np.pi * random.random(self.tones)
        rates = 2 * np.pi * self.frequency.spread(random, self.tones)
        return size * np.sin(rates[:, None] * t + phases[:, None]).sum(axis=0)


FAMILIES: dict[str, type[Steps] | type[Ramps] | type[Sines] | type[Multisine]] = {
    "steps": Steps,
    "ramps": Ramps,
    "sines": Sines,
    "multisine": Multisine,
}


def _pieces(t: np.ndarray, hold: Range) -> int:
    """How many pieces are enough to reach the last time; never more than samples."""
    return min(int(t[-1] / hold.low) + 1, len(t))
