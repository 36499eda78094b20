"""Is a residual noise? Its spectrum and its autocorrelation, with bands that know how coloured the noise itself is."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

_SEGMENT = 512  # rows of a spectrum's segments
_LAGS = 200
_AS_IS: Any = False  # no detrending: an offset is part of a residual (scipy's stubs know only words here)


@dataclass(frozen=True)
class Whiteness:
    """Spectrum and autocorrelation of one signal's residuals, pooled over records.

    f [k] Hz and density [k] (SI^2/Hz, one-sided); lag [m] s and autocorrelation [m], with the 95 % `band` (+-) that a
    residual of nothing but the measured noise would stay in: 1.96 sqrt(kappa / N), kappa from the noise floor.
    """

    f: np.ndarray
    density: np.ndarray
    lag: np.ndarray
    autocorrelation: np.ndarray
    band: float


def whiteness(errors: Sequence[np.ndarray], period: float, kappa: float) -> Whiteness:
    """Whiteness of residuals [n], one array a record, NaN where not compared; `period` [s] of the records.

    A missing sample counts as no pair in the autocorrelation and as zero in the spectrum, which is scaled up for it.
    """
    from scipy.signal import welch  # here, as it takes a third of a second

    valid = [np.isfinite(error) for error in errors]
    filled = [np.where(mask, error, 0.0) for mask, error in zip(valid, errors, strict=True)]
    segment = min(_SEGMENT, min(len(error) for error in errors))
    spectra = [welch(error, 1 / period, nperseg=segment, detrend=_AS_IS) for error in filled]
    weights = np.array([mask.sum() for mask in valid], dtype=float)
    shares = weights / np.array([len(error) for error in errors])
    density = sum(
        (w / s * p for w, s, (_, p) in zip(weights, shares, spectra, strict=True)), np.zeros(segment // 2 + 1)
    )
    lags = min(_LAGS, segment - 1)
    products = sum((_lagged(error, lags) for error in filled), np.zeros(lags + 1))
    pairs = sum((_lagged(mask.astype(float), lags) for mask in valid), np.zeros(lags + 1))
    covariance = products / np.maximum(pairs, 1)
    return Whiteness(
        f=spectra[0][0],
        density=density / weights.sum(),
        lag=np.arange(lags + 1) * period,
        autocorrelation=covariance / covariance[0] if covariance[0] > 0 else covariance,
        band=float(1.96 * np.sqrt(kappa / weights.sum())),
    )


def _lagged(values: np.ndarray, lags: int) -> np.ndarray:
    """Sums of values[i] values[i + k], k = 0 .. lags."""
    return np.array([values[: len(values) - k] @ values[k:] for k in range(lags + 1)])
