"""How late measured signals are against what a model predicts of them, and which are late together."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .model import Model
from .windows import Windows

_MOST = 0.05  # s: no later is looked for, nor by more than a quarter of a window
_TOGETHER = 1.5e-3  # s: signals whose lags are no further apart are late together


@dataclass(frozen=True, eq=False)
class Lags:
    """Correlations [lags, signals] of measured with predicted signals, by how much [s] they are late [lags]."""

    names: tuple[str, ...]
    late: np.ndarray
    correlations: np.ndarray

    @property
    def period(self) -> float:
        """From one lag to the next [s]."""
        return float(self.late[1] - self.late[0])

    def best(self, name: str, sign: int) -> tuple[float, float]:
        """The lag [s] at which a signal moves most like what is predicted, or by sign -1 like its opposite, between
        rows by a parabola; and that correlation, turned to be positive."""
        rho = sign * self.correlations[:, self.names.index(name)]
        k = int(np.argmax(rho))
        if not 0 < k < len(rho) - 1:
            return float(self.late[k]), float(rho[k])
        before, here, after = rho[k - 1 : k + 2]
        bend = before - 2 * here + after
        return float(self.late[k] + self.period * (0.5 * (before - after) / bend if bend < 0 else 0.0)), float(here)


def lags_of(model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray) -> Lags:
    """The lags of signals in windows, against the model's runs with parameters p [k] from x0 [windows, n]."""
    period = windows.records[0].period
    rows = max(1, min(round(_MOST / period), min(group.weight.shape[1] for group in windows.groups) // 4))
    sums = np.zeros((3, 2 * rows + 1, len(windows.names)))
    for group, predicted in zip(windows.groups, model.predict(windows, x0, p), strict=True):
        y, m = (np.where(group.weight > 0, np.nan_to_num(v), 0.0) * group.weight for v in (predicted, group.measured))
        inner = slice(rows, y.shape[1] - rows)
        y = y[:, inner] - y[:, inner].mean(axis=1, keepdims=True)
        for k in range(2 * rows + 1):
            late = m[:, k : k + y.shape[1]]
            late = late - late.mean(axis=1, keepdims=True)
            sums[:, k] += [np.einsum("wrs,wrs->s", a, b) for a, b in ((y, late), (y, y), (late, late))]
    both, ours, theirs = sums
    return Lags(windows.names, period * np.arange(-rows, rows + 1), both / np.sqrt(np.maximum(ours * theirs, 1e-300)))


def apart(lags: Mapping[str, float]) -> dict[str, float]:
    """The signals that are late, or early, against those nearest to the command, and by how much [s]: one value for
    all that are late together."""
    order = sorted(lags, key=lambda name: lags[name])
    groups = [order[:1]]
    for before, name in pairwise(order):
        if lags[name] - lags[before] > _TOGETHER:
            groups.append([])
        groups[-1].append(name)
    means = [float(np.mean([lags[name] for name in group])) for group in groups]
    first = min(means, key=abs)
    late = {name: mean - first for group, mean in zip(groups, means, strict=True) for name in group if mean != first}
    return {name: late[name] for name in lags if name in late}
