"""Arrays as text that a browser reads at once: 32-bit floats in base 64."""

from base64 import b64encode

import numpy as np


def packed(values: np.ndarray) -> str:
    """Values [k] or [lanes, k], row after row; what is not finite is NaN."""
    return b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def number(value: float | None) -> float | None:
    """A number for JSON, None where there is none."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.6g}")
