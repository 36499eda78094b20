"""A balance of wrenches by frequency, every line over its noise, so that slow ones count for what they are worth.

The noise of an acceleration that positions say goes with the square of the frequency: a balance in time is as loud as
its fastest part, and hides what its slow part tells.
"""

from dataclasses import dataclass

import numpy as np

BAND = 30.0  # Hz: up to which lines are judged
ENDS = 0.2  # s at both ends of a record, which filters bend
_FADE = 0.1  # of a record, at both ends
_ROUNDS = 200  # of a fit
_SLOW = 4  # lines
_POWERS = (0, 2, 4)  # of the frequency, in the power of the noise


def lines(values: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [k] Hz up to BAND, above 0, and lines [k, ..] of values [n, ..] at a period, of white noise as large
    as its standard deviation. Their mean is taken off: load cells have an offset."""
    kept = inner(values, period)
    window = _window(len(kept))
    shaped = (kept - np.average(kept, axis=0, weights=window)) * window.reshape(-1, *[1] * (values.ndim - 1))
    f = np.fft.rfftfreq(len(kept), period)
    judged = (f > 0) & (f <= BAND)
    return f[judged], np.fft.rfft(shaped, axis=0)[judged] / np.sqrt(np.sum(window**2))


def inner(values: np.ndarray, period: float) -> np.ndarray:
    """Values [n, ..] without their ends."""
    edge = round(ENDS / period)
    return values[edge : len(values) - edge]


def _window(n: int) -> np.ndarray:
    """1, with a cosine at both ends."""
    fade = np.clip(np.minimum(np.arange(n), n - 1 - np.arange(n)) / (_FADE * n), 0.0, 1.0)
    return (1 - np.cos(np.pi * fade)) / 2


@dataclass(frozen=True, eq=False)
class LineNoise:
    """The power of the noise of six components as a sum of even powers of the frequency, `powers` [3, 6], and of how
    many real samples it is."""

    powers: np.ndarray
    samples: int

    def over(self, f: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Lines [k, 6, ..] at frequencies [k] as real samples over their noise [2 k, 6, ..]."""
        scale = np.sqrt(_shapes(f) @ self.powers / 2)
        scaled = values / scale.reshape(*scale.shape, *[1] * (values.ndim - 2))
        return np.concatenate((scaled.real, scaled.imag))


def line_noise(f: np.ndarray, values: np.ndarray) -> LineNoise:
    """Noise of lines [k, 6] at rest at frequencies [k], by likelihood of their powers (Whittle). Steps are of Itakura
    and Saito's distance (Fevotte, Bertin and Durrieu, Neural Computation 21(3), 2009): each makes the likelihood
    greater. What is white is no less than half of what the slowest lines have."""
    shapes, power = _shapes(f), np.abs(values) ** 2
    found = np.full((len(_POWERS), values.shape[1]), power.mean(axis=0) / len(_POWERS))
    for _ in range(_ROUNDS):
        model = shapes @ found
        found = found * np.sqrt((shapes.T @ (power / model**2)) / (shapes.T @ (1 / model)))
    found[0] = np.maximum(found[0], power[:_SLOW].mean(axis=0) / 2)
    return LineNoise(found, 2 * power.size)


def _shapes(f: np.ndarray) -> np.ndarray:
    """[k, 3], of no size that matters."""
    return np.column_stack([(f / BAND) ** power for power in _POWERS])
