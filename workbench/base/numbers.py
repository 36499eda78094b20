"""Numbers for metrics.json and tables."""

import math
from typing import SupportsFloat

import numpy as np


def finite(value: SupportsFloat) -> float | None:
    """The number, or None for one that does not exist."""
    return float(value) if math.isfinite(float(value)) else None


def quantile(values: np.ndarray, share: float) -> float | None:
    """The least of values [n] that so great a share of them does not exceed; None where that is infinite."""
    return finite(np.quantile(values, share, method="higher"))
