"""A Kalman filter and smoother of many linear models at once, row by row and signal by signal.

Signals have independent noise of variance one, and are taken one after the other by the update of Bucy and Joseph
(Filtering for Stochastic Processes with Applications to Guidance, 1968, p. 141), which keeps a covariance definite
where it is large beside the noise. The smoother carries adjoints back (Bryson, Frazier; Bierman, Factorization Methods
for Discrete Sequential Estimation, 1977, ch. X), so that no covariance is inverted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Measured:
    """What one signal of a row told: its output row h [..., n], the miss [...] and its variance [...], and the gain
    [..., n] by which the state followed."""

    h: np.ndarray
    miss: np.ndarray
    variance: np.ndarray
    gain: np.ndarray

    @property
    def log_likelihood(self) -> np.ndarray:
        """The log-likelihood of the miss, [...], but for a constant."""
        return -0.5 * (self.miss**2 / self.variance + np.log(self.variance))


def update(
    x: np.ndarray, covariance: np.ndarray, output: np.ndarray, e: np.ndarray
) -> tuple[np.ndarray, np.ndarray, list[Measured]]:
    """State [..., n] and covariance [..., n, n] once a row's signals e [..., s] = output @ x + noise are known."""
    told = []
    for j in range(output.shape[-2]):
        h = output[..., j, :]
        cross = (covariance @ h[..., None])[..., 0]
        variance = 1.0 + np.maximum(np.einsum("...i,...i->...", cross, h), 0.0)
        gain = cross / variance[..., None]
        miss = e[..., j] - np.einsum("...i,...i->...", h, x)
        x = x + gain * miss[..., None]
        half = gain[..., :, None] * cross[..., None, :]
        np.subtract(covariance, half, out=half)
        kept = gain - (half @ h[..., None])[..., 0]
        covariance = kept[..., :, None] * gain[..., None, :]
        covariance += half
        told.append(Measured(h, miss, variance, gain))
    return x, covariance, told


def predict(
    x: np.ndarray, covariance: np.ndarray, step: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The next row's state and covariance, by x' = step @ x and independent noise of variances [..., n]."""
    x = (step @ x[..., None])[..., 0]
    covariance = step @ covariance @ np.swapaxes(step, -1, -2)
    covariance = 0.5 * (covariance + np.swapaxes(covariance, -1, -2))
    diagonal = np.einsum("...ii->...i", covariance)
    diagonal += noise
    return x, covariance


def carried_back(adjoint: np.ndarray, told: Sequence[Measured]) -> np.ndarray:
    """The adjoint [..., n] before a row's signals, from that behind them: the smoothed state is that predicted less
    the predicted covariance times it."""
    for one in reversed(told):
        along = np.einsum("...i,...i->...", one.gain, adjoint) + one.miss / one.variance
        adjoint = adjoint - one.h * along[..., None]
    return adjoint
