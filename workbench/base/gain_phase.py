"""Gain in decibels and phase in degrees of a complex response."""

import numpy as np
from numpy.typing import NDArray


def gain_db(response: np.ndarray) -> NDArray[np.float64]:
    """20 log10 |response|; a gap (NaN) where the response is zero or not finite."""
    size = np.abs(np.asarray(response, dtype=complex))
    return 20 * np.log10(np.where(np.isfinite(size) & (size > 0), size, np.nan))


def phase_deg(response: np.ndarray) -> NDArray[np.float64]:
    """Phase [deg] of responses [k], unwrapped across gaps (NaN).

    It starts in (-270, 90], so that a double integrator starts at -180 whatever its rounding.
    """
    response = np.asarray(response, dtype=complex)
    phase = np.full(response.shape, np.nan)
    there = np.isfinite(response) & (response != 0)
    if there.any():
        whole = np.degrees(np.unwrap(np.angle(response[there])))
        phase[there] = whole - (360 if whole[0] > 90 + 1e-9 else 0)
    return phase
