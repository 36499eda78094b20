"""The noise of one signal from its errors in repeated runs: how large, of which colour, and how well that is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

MAINS = (50.0, 60.0, 100.0, 120.0)  # Hz
MAINS_SPAN = 0.5  # s; a shorter run cannot tell a mains line from its neighbours


@dataclass(frozen=True)
class RepeatedRun:
    """Errors [n] of one signal at even times, where they count [n] bool, period in s, numbers fitted to them."""

    error: np.ndarray
    valid: np.ndarray
    period: float
    fitted: int = 0


class SignalNoise(NamedTuple):
    """Noise of one signal: sigma (SI); kappa, variance of a mean over that of white noise, >= 1; colour, the same of a
    mean square; and how many white samples would give sigma^2 as well as it is known, infinite where it is exact."""

    sigma: float
    kappa: float
    colour: float
    known_by: float


def signal_noise(runs: Sequence[RepeatedRun]) -> SignalNoise:
    """The noise of one signal's errors, pooled over runs: kappa = 1 + 2 sum rho_k, colour = 1 + 2 sum rho_k^2.

    The sums end at the first lag beyond six times kappa (Sokal's window: Madras and Sokal 1988, J. Stat. Phys. 50,
    appendix C). Mains lines count in sigma, not in the sums: over whole periods they move no mean.
    """
    squares = sum(float(np.sum(run.error[run.valid] ** 2)) for run in runs)
    rows = sum(max(1, int(run.valid.sum()) - run.fitted) for run in runs)
    variance = squares / rows
    if variance == 0.0:
        return SignalNoise(0.0, 1.0, 1.0, np.inf)
    kappa = colour = 1.0
    for lag, covariance in enumerate(_covariances(runs), 1):
        kappa += 2.0 * float(covariance) / variance
        colour += 2.0 * (float(covariance) / variance) ** 2
        if lag >= 6.0 * kappa:
            break
    return SignalNoise(float(np.sqrt(variance)), max(1.0, kappa), colour, rows / colour)


def together(first: SignalNoise, second: SignalNoise) -> SignalNoise:
    """The noise of the sum of two that know nothing of each other; one of them is taken for white where they meet."""
    a, b = first.sigma**2, second.sigma**2
    if b == 0.0:
        return first
    whole = a + b
    kappa = (a * first.kappa + b * second.kappa) / whole
    colour = (a**2 * first.colour + 2.0 * a * b + b**2 * second.colour) / whole**2
    unknown = (a**2 / first.known_by + b**2 / second.known_by) / whole**2
    return SignalNoise(float(np.sqrt(whole)), max(1.0, kappa), colour, 1.0 / unknown if unknown else np.inf)


def _covariances(runs: Sequence[RepeatedRun]) -> np.ndarray:
    """Autocovariance at lags 1, 2 ... over pairs of valid samples, mains lines taken off."""
    most = max(2, max(run.error.size for run in runs) // 4)
    products, pairs = np.zeros(most), np.zeros(most)
    for run in runs:
        hum = orthonormal(mains(run.error.size, run.period))
        products += _correlate(np.where(run.valid, without(hum, run.error), 0.0), most)
        pairs += _correlate(run.valid.astype(float), most)
    return products[1:] / np.maximum(pairs[1:], 1.0)


def _correlate(values: np.ndarray, lags: int) -> np.ndarray:
    """Sums of values[i] values[i + k], k = 0 .. lags - 1."""
    length = values.size + lags
    return np.fft.irfft(np.abs(np.fft.rfft(values, length)) ** 2, length)[:lags]


def mains(rows: int, period: float) -> np.ndarray:
    """cos and sin [n, 8] of the mains lines, those below the Nyquist frequency; [n, 0] where the run is too short."""
    lines = [f for f in MAINS if rows * period >= MAINS_SPAN and f * period < 0.5]
    phase = 2.0 * np.pi * period * np.outer(np.arange(rows), lines)
    return np.hstack((np.cos(phase), np.sin(phase)))


def orthonormal(columns: np.ndarray) -> np.ndarray:
    return np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny))[0]


def without(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return values - basis @ (basis.T @ values)
