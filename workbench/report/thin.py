"""Thinning for display: of long series, the same extremes remain; of curves in a plane, the same outline."""

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


def window_points(
    x: NDArray[np.float64], y: NDArray[np.float64], window: tuple[float, float] | None
) -> NDArray[np.intp]:
    """Ascending indices of the samples of a curve, (n,) each, to draw: inside the `window` of x, that is shown at
    first, as many points as elsewhere a whole curve has."""
    y = np.where(np.isfinite(x), y, np.nan)
    if window is None:
        return drawn_points(y)
    inside = np.flatnonzero((x >= window[0]) & (x <= window[1]))
    return np.union1d(drawn_points(y), inside[drawn_points(y[inside])])


def outline_points(x: NDArray[np.float64], y: NDArray[np.float64], x_near: float, y_near: float) -> NDArray[np.intp]:
    """Ascending indices of the samples of a curve in a plane, (n,) each, to draw; missing samples are kept.

    The straight lines between them pass every other sample within `x_near` and `y_near` (of an ellipse). Douglas and
    Peucker 1973.
    """
    points = np.column_stack((x / x_near, y / y_near))
    keep: NDArray[np.bool_] = np.any(~np.isfinite(points), axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate(([True], keep, [True])).astype(int)))
    stretches = [(int(first), int(after) - 1) for first, after in edges.reshape(-1, 2)]
    while stretches:
        first, last = stretches.pop()
        keep[[first, last]] = True
        away = _away_from_chord(points[first : last + 1])
        middle = first + int(away.argmax())
        if away.max() > 1:
            stretches += [(first, middle), (middle, last)]
    return np.flatnonzero(keep)


def _away_from_chord(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances of points [k, 2] from the line between the first and the last of them."""
    beside, chord = points - points[0], points[-1] - points[0]
    length = float(chord @ chord)
    share = np.clip(beside @ chord / length, 0, 1) if length else np.zeros(len(points))
    return np.hypot(*(beside - share[:, None] * chord).T)
