"""In which equation does a residual sit? A random disturbance is added to one equation at a time; evidence compares.

About the fitted trajectory the errors obey e_k = C x_k + D d_k + noise, x_(k+1) = A x_k + B d_k, with A to D the exact
tangents of every sampling interval and d an Ornstein-Uhlenbeck process in the inputs that the probes add to one
equation. A Kalman filter gives the likelihood of the errors for each amplitude and correlation time; the gain in
log-likelihood over no disturbance is the evidence of that equation (Kristensen, Madsen and Jorgensen, Automatica 40(2),
2004, section 2: noise in one equation at a time). Smoothing gives the missing force, flow or drive.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .model import Model
from .windows import Windows

AMPLITUDES = (0.1, 1.0, 10.0, 100.0, 1000.0)  # over the one that moves the most sensitive signal by sigma in 10 ms
TIMES = (1e-3, 2e-2)  # s: correlation time
_LENGTH = 10e-3  # s
_FOREVER = 1e9  # s: correlation time of a constant


@dataclass(frozen=True, eq=False)
class Local:
    """The linear model of a group's windows over sigma, states and inputs over their scales, row by row.

    e [w, rows, s]; a [w, rows, n, n]; b [w, rows, n, m]; c [w, rows, s, n]; d [w, rows, s, m].
    """

    e: np.ndarray
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray

    def inputs(self, columns: Sequence[int]) -> "Local":
        """With some of the inputs only."""
        return Local(self.e, self.a, self.b[..., columns], self.c, self.d[..., columns])


@dataclass(frozen=True)
class Evidence:
    """Gain in log-likelihood by a disturbance in one equation, its correlation time [s] and amplitudes [windows]."""

    equation: str
    gain: float
    time: float
    amplitudes: np.ndarray


def localise(groups: Mapping[str, Sequence[Local]], period: float) -> list[Evidence]:
    """The evidence of every equation, most first. `groups` has the windows with the inputs of each equation alone.

    A disturbance's amplitude may differ from window to window: effects come in bursts.
    """
    plain = next(iter(groups.values()))
    nothing = [likelihood(one.inputs([]), np.zeros(1), period, 1.0)[0] for one in plain]
    found = []
    for equation, parts in groups.items():
        sizes = np.array(AMPLITUDES) * _unit(parts, period)
        times = (_FOREVER,) if equation == "sensor" else TIMES
        tried = [_gain(parts, nothing, sizes, period, time) for time in times]
        best = int(np.argmax([gain for gain, _ in tried]))
        found.append(Evidence(equation, tried[best][0], times[best], tried[best][1]))
    return sorted(found, key=lambda one: -one.gain)


def _gain(
    parts: Sequence[Local], nothing: Sequence[np.ndarray], sizes: np.ndarray, period: float, time: float
) -> tuple[float, np.ndarray]:
    """Gain over all windows, each at its best amplitude, and those amplitudes."""
    gain, chosen = 0.0, []
    for one, before in zip(parts, nothing, strict=True):
        found = likelihood(one, sizes, period, time) - before
        gain += float(np.maximum(found.max(axis=0), 0.0).sum())
        chosen.append(sizes[np.argmax(found, axis=0)])
    return gain, np.concatenate(chosen)


def _unit(parts: Sequence[Local], period: float) -> float:
    """The amplitude of a disturbance that moves the most sensitive signal by one sigma within 10 ms."""
    rows = max(1, round(_LENGTH / period))
    most = 0.0
    for one in parts:
        x = np.zeros((*one.b.shape[:1], one.b.shape[2], one.b.shape[3]))
        for k in range(min(rows, one.e.shape[1])):
            seen = one.c[:, k] @ x + one.d[:, k]
            most = max(most, float(np.abs(seen).max(initial=0.0)))
            x = one.a[:, k] @ x + one.b[:, k]
    return 1.0 / max(most, 1e-12)


def likelihood(one: Local, sizes: np.ndarray, period: float, time: float) -> np.ndarray:
    """Log-likelihood [h, w] of the errors for disturbances of amplitudes `sizes` [h] and correlation time `time` [s]."""
    kept = float(np.exp(-period / time))
    n, m, s = one.a.shape[-1], one.b.shape[-1], one.c.shape[2]
    h, w = len(sizes), one.e.shape[0]
    x, spread = np.zeros((h, w, n + m)), np.zeros((h, w, n + m, n + m))
    spread[..., range(n), range(n)] = 1.0
    for i in range(m):
        spread[..., n + i, n + i] = (sizes**2)[:, None]
    drive = sizes**2 * (1 - kept**2)
    total = np.zeros((h, w))
    step = np.zeros((h, w, n + m, n + m))
    step[:, :, range(n, n + m), range(n, n + m)] = kept
    eye = np.eye(s)
    for k in range(one.e.shape[1]):
        seen = np.concatenate((one.c[:, k], one.d[:, k]), axis=-1)  # [w, s, n + m]
        cross = spread @ np.swapaxes(seen, -1, -2)
        inner = seen @ cross + eye
        miss = one.e[:, k] - (seen @ x[..., None])[..., 0]
        gain = np.swapaxes(np.linalg.solve(inner, np.swapaxes(cross, -1, -2)), -1, -2)
        factor = np.linalg.cholesky(inner)
        white = np.linalg.solve(inner, miss[..., None])[..., 0]
        total -= 0.5 * np.einsum("hws,hws->hw", miss, white)
        total -= np.log(np.einsum("hwss->hws", factor)).sum(axis=-1)
        x = x + (gain @ miss[..., None])[..., 0]
        spread = spread - gain @ np.swapaxes(cross, -1, -2)
        step[:, :, :n, :n], step[:, :, :n, n:] = one.a[:, k], one.b[:, k]
        x = (step @ x[..., None])[..., 0]
        spread = step @ spread @ np.swapaxes(step, -1, -2)
        for i in range(m):
            spread[..., n + i, n + i] += drive[:, None]
        spread = 0.5 * (spread + np.swapaxes(spread, -1, -2))
    return total


def linear(model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray, inputs: Sequence[int]) -> list[Local]:
    """The windows linearised about their trajectories, for some inputs."""
    return [Local(*parts) for parts in model.linear(windows, x0, p, inputs)]
