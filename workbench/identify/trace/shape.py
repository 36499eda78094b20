"""What an unknown effect looks like: the missing force, flow or drive over time, and the signal that it goes with."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

_FOLDS = 5
_TAIL = (0.0, 0.005, 0.015, 0.04, 0.09)  # of the points: the pieces of a curve get shorter towards its ends
_EDGES = (*_TAIL, *np.linspace(0.17, 0.83, 9).tolist(), *(1 - share for share in reversed(_TAIL)))
_FEWEST = 5  # points in a piece
_LINE = 20.0  # a spectral line stands out of the neighbouring spectrum by this factor in power
_NEIGHBOURS = 15


@dataclass(frozen=True, eq=False)
class Shape:
    """A disturbance against the signal that explains most of it.

    `explained`: cross-validated R2 of a curve through each signal, most first. `signal` [n] and `disturbance` [n] are
    the points, `curve` [k, 2] the curve. `line` is a frequency [Hz] at which the disturbance repeats, or None.
    """

    name: str
    unit: str
    explained: tuple[tuple[str, float], ...]
    signal: np.ndarray
    disturbance: np.ndarray
    curve: np.ndarray
    line: float | None


def shape(name: str, unit: str, disturbance: np.ndarray, signals: Mapping[str, np.ndarray], period: float) -> Shape:
    """The shape of a disturbance [windows, n] by signals of the same form."""
    d = disturbance.ravel()
    ranked = sorted(((key, _explained(d, value.ravel())) for key, value in signals.items()), key=lambda pair: -pair[1])
    best = signals[ranked[0][0]].ravel()
    return Shape(name, unit, tuple(ranked), best, d, _curve(best, d), _line(disturbance, period))


def _explained(d: np.ndarray, signal: np.ndarray) -> float:
    """Cross-validated R2 of the mean of d in pieces along the signal."""
    fold = (np.arange(d.size) * _FOLDS) // d.size
    left = np.empty(d.size)
    for k in range(_FOLDS):
        test = fold == k
        knots = _curve(signal[~test], d[~test])
        left[test] = d[test] - np.interp(signal[test], knots[:, 0], knots[:, 1])
    total = float(np.sum((d - d.mean()) ** 2))
    return 1 - float(np.sum(left**2)) / total if total > 0 else 0.0


def _curve(signal: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Means of signal and d over pieces [k, 2], in increasing order of the signal.

    What saturates, opens or sticks shows at the ends of a signal, where few points are: pieces are shorter there.
    """
    edges = np.unique(np.round(np.array(_EDGES) * signal.size).astype(int))
    edges = edges[(edges == 0) | (edges == signal.size) | ((edges >= _FEWEST) & (edges <= signal.size - _FEWEST))]
    parts = np.split(np.argsort(signal, kind="stable"), edges[1:-1])
    return np.array([(signal[part].mean(), d[part].mean()) for part in parts if part.size])


def _line(disturbance: np.ndarray, period: float) -> float | None:
    """The frequency [Hz] whose power stands far out of that of its neighbours, over all windows; None without one."""
    n = disturbance.shape[1]
    tapered = (disturbance - disturbance.mean(axis=1, keepdims=True)) * np.hanning(n)
    power = np.sum(np.abs(np.fft.rfft(tapered, 4 * n, axis=1)) ** 2, axis=0)
    f = np.fft.rfftfreq(4 * n, period)
    top = int(np.argmax(np.where(f > 4 / (n * period), power, 0.0)))
    near = [k for k in range(top - 4 * _NEIGHBOURS, top + 4 * _NEIGHBOURS) if 0 < k < power.size and abs(k - top) > 12]
    level = float(np.median(power[near])) if near else np.inf
    return float(f[top]) if power[top] > _LINE * level else None
