"""Linear loops of one law on many plants: poles, largest sensitivity and gain margin, lane by lane."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ..control.linear_law import LinearLaw
from ..engine import periods
from ..linear.equilibria import Equilibria, slopes
from ..plant import Plant

_LOWEST, _POINTS = 0.05, 400  # Hz, frequencies up to Nyquist's


@dataclass(frozen=True)
class LaneMargins:
    """Largest |z| of the poles [lanes]; Ms [1] and gain margin [dB] in either direction, NaN for an unstable loop."""

    radius: np.ndarray
    ms: np.ndarray
    gain_margin_db: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """Bool [lanes]."""
        return self.radius < 1 - 1e-9


def lane_margins(
    plant: Plant, law: LinearLaw, points: Equilibria, p: np.ndarray, period: float, delay: float
) -> LaneMargins:
    """The loops of a law on plants with parameters p [lanes, k] about `points`, commands `delay` [s] late.

    The margins are read on a fixed grid of frequencies; sharp peaks between its points are interpolated.
    """
    a, b, c, d = _sampled(plant, law, points, p, period, delay)
    radius = np.abs(np.linalg.eigvals(_closed(a, b, c, d, law))).max(axis=1)
    f = np.geomspace(_LOWEST, 0.5 / period, _POINTS)
    loop = -np.einsum("fm,lmf->lf", _gains(law, f, period)[:, 1:], _responses(a, b, c, d, f, period))
    stable = radius < 1 - 1e-9
    sensitivity, margin = _peak(1 / np.abs(1 + loop)), _gain_margin(loop)
    return LaneMargins(radius, np.where(stable, sensitivity, np.nan), np.where(stable, margin, np.nan))


def _sampled(
    plant: Plant, law: LinearLaw, points: Equilibria, p: np.ndarray, period: float, delay: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C, D in lanes of what the law sees of the held command; whole periods of delay are further states."""
    whole, part = periods(delay, period)
    a, b, c, d = slopes(plant, points.x, points.u, p)
    rows = [plant.output(name) for name in law.measures]
    b, c, d = b[:, :, :1], c[:, rows], d[:, rows, :1]
    newest, newer = _held(a, b, (1 - part) * period)
    before, older = _held(a, b, part * period)
    ahead, lanes, n = newest @ before, len(a), a.shape[1]
    taps = [newer] if not part else [newer, newest @ older]
    way = whole + len(taps) - 1
    whole_a = np.zeros((lanes, n + way, n + way))
    whole_a[:, :n, :n] = ahead
    whole_b, whole_c = np.zeros((lanes, n + way, 1)), np.concatenate((c, np.zeros((lanes, len(rows), way))), axis=2)
    for i, tap in enumerate(taps, start=whole):
        if i == 0:
            whole_b[:, :n] = tap
        else:
            whole_a[:, :n, n + i - 1] = tap[:, :, 0]
    if way:
        whole_b[:, n] = 1.0
        whole_a[:, n + 1 :, n : n + way - 1] = np.eye(way - 1)
    if whole:
        whole_c[:, :, n + whole - 1], d = d[:, :, 0], np.zeros_like(d)
    return whole_a, whole_b, whole_c, d


def _held(a: np.ndarray, b: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """The states after `seconds`, of themselves and of a held input, in lanes."""
    n = a.shape[1]
    both = np.zeros((len(a), n + 1, n + 1))
    both[:, :n] = np.concatenate((a, b), axis=2) * seconds
    ahead = expm(both)
    return ahead[:, :n, :n], ahead[:, :n, n:]


def _closed(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, law: LinearLaw) -> np.ndarray:
    """The loop's own matrix in lanes, the drive doing what the law demands."""
    gains, entering = law.d[1:], law.b[:, 1:] + np.outer(law.e, law.d[1:])
    inner = 1 - d[:, :, 0] @ gains  # the law's own command may reach what it measures at once
    u_x, u_w = (gains @ c) / inner[:, None], law.c / inner[:, None]
    y_x = c + d * u_x[:, None, :]
    y_w = d * u_w[:, None, :]
    top = np.concatenate((a + b * u_x[:, None, :], b * u_w[:, None, :]), axis=2)
    bottom = np.concatenate((entering @ y_x, law.a + np.outer(law.e, law.c) + entering @ y_w), axis=2)
    return np.concatenate((top, bottom), axis=1)


def _gains(law: LinearLaw, f: np.ndarray, period: float) -> np.ndarray:
    """The law's response from (r, y) to the command at f [k] in Hz, complex [k, 1 + m]."""
    z = np.exp(2j * np.pi * f * period)
    a, b = law.a + np.outer(law.e, law.c), law.b + np.outer(law.e, law.d)
    inner = np.linalg.solve(z[:, None, None] * np.eye(law.states) - a, np.broadcast_to(b, (len(f), *b.shape)))
    return law.c @ inner + law.d


def _responses(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, f: np.ndarray, period: float) -> np.ndarray:
    """Responses of the measured signals [lanes, m, k], by the modes of each lane."""
    z = np.exp(2j * np.pi * f * period)
    modes, right = np.linalg.eig(a)
    entering = np.linalg.solve(right, b.astype(complex))[:, :, 0]
    leaving = c @ right
    return np.einsum("lmn,lnf->lmf", leaving * entering[:, None], 1 / (z - modes[..., None])) + d


def _peak(level: np.ndarray) -> np.ndarray:
    """Largest value of each row, by the parabola through the largest point and its neighbours."""
    lanes, i = np.arange(len(level)), np.clip(np.argmax(level, axis=1), 1, level.shape[1] - 2)
    left, middle, right = (level[lanes, i + k] for k in (-1, 0, 1))
    bend = left - 2 * middle + right
    top = middle - (right - left) ** 2 / (8 * np.where(bend < 0, bend, -np.inf))
    return np.maximum(level.max(axis=1), top)


def _gain_margin(loop: np.ndarray) -> np.ndarray:
    """Least |gain margin| [dB] where the loop crosses the negative real axis; the last point lies on it."""
    real, imag = np.real(loop), np.imag(loop)
    crosses = np.signbit(imag[:, 1:]) != np.signbit(imag[:, :-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        part = imag[:, :-1] / (imag[:, :-1] - imag[:, 1:])
        at = real[:, :-1] + part * np.diff(real, axis=1)
        margin = np.where(crosses & (at < 0), np.abs(20 * np.log10(np.abs(at))), np.inf)
        last = np.where(real[:, -1] < 0, np.abs(20 * np.log10(np.abs(real[:, -1]))), np.inf)
    least = np.minimum(margin.min(axis=1), last)
    return np.where(np.isfinite(least), least, np.nan)
