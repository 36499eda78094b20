"""Noise that a sensor's rounding hides at rest and does not in motion."""

from collections.abc import Iterable

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtr

HIDDEN = 0.7  # of the step: a standard deviation of readings at rest below which rounding hides part of the noise
_FEWEST = 20  # rows


def rounded_sigma(at_rest: Iterable[np.ndarray], step: float) -> float:
    """Standard deviation of readings in steps of `step` while what they measure moves, from readings [n] at rest.

    In motion rounding is one more noise, of variance step^2/12 (Widrow and Kollar, Quantization Noise, 2008, ch. 5).
    At rest a noise of less than a step shows as how often the levels beside the middle are read, more or less so by
    where between two levels the sensor stands: place and noise that make the levels read most likely are taken.
    """
    hidden = [variance for values in at_rest if (variance := _under(values, step)) is not None]
    return float(np.sqrt(step**2 / 12 + (np.mean(hidden) if hidden else 0.0)))


def _under(values: np.ndarray, step: float) -> float | None:
    """Variance of the noise under the rounding; None where one level was read."""
    if values.size < _FEWEST:
        return None
    levels = np.round((values - values.min()) / step)
    counts = np.bincount(levels.astype(int))
    if len(counts) < 2:
        return None
    edges = np.arange(len(counts) + 1) - 0.5

    def unlikely(guess: np.ndarray) -> float:
        share = np.diff(ndtr((edges - guess[0]) / np.exp(guess[1])))
        return -float(counts @ np.log(np.maximum(share, 1e-300)))

    begin = np.array([levels.mean(), np.log(max(levels.std(), 0.1))])
    found = minimize(unlikely, begin, method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-3})
    return float((step * np.exp(found.x[1])) ** 2)
