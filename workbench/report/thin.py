"""Thinning of long series for display: fewer points, the same extremes."""

import numpy as np
from numpy.typing import NDArray

DRAWN_POINTS = 2000  # about two points a pixel on a wide screen: a thinned curve looks like the whole one


def drawn_points(y: NDArray[np.float64], points: int = DRAWN_POINTS) -> NDArray[np.intp]:
    """Ascending indices of the samples of `y`, (n,), to draw.

    Both ends, and the least and the greatest finite value of each bucket. Where a bucket holds a gap its first missing
    sample is kept too, so that a gap stays a gap. A series of at most `points` samples is kept whole; a longer one
    gives at most 3/2 `points` + 2.
    """
    n = len(y)
    if n <= points:
        return np.arange(n)
    size = -(-n // max(points // 2, 1))
    padded = np.full(-(-n // size) * size, np.nan)
    padded[:n] = y
    rows = padded.reshape(-1, size)
    missing = ~np.isfinite(rows)
    start = np.arange(len(rows)) * size
    least = start + np.where(missing, np.inf, rows).argmin(axis=1)
    greatest = start + np.where(missing, -np.inf, rows).argmax(axis=1)
    gaps = (start + missing.argmax(axis=1))[missing.any(axis=1)]
    every = np.concatenate((least, greatest, gaps, [0, n - 1]))
    return np.unique(every[every < n])
