"""Numbers for metrics.json and tables."""

import math
from typing import Any, SupportsFloat

import numpy as np

from .errors import InputError


def finite(value: SupportsFloat) -> float | None:
    """The number, or None for one that does not exist."""
    return float(value) if math.isfinite(float(value)) else None


def quantile(values: np.ndarray, share: float) -> float | None:
    """The least of values [n] that so great a share of them does not exceed; None where that is infinite."""
    return finite(np.quantile(values, share, method="higher"))


def sampling_period(system: Any) -> float:
    """Period [s] of a python-control system, 0 in continuous time. Raises InputError for dt=True, which names none."""
    if system.dt is True:
        raise InputError("the system has dt=True, which is no period; give it in seconds, such as dt=0.001")
    return float(system.dt or 0.0)
