"""Linear loops of one law on many plants: poles, largest sensitivity and gain margin, lane by lane."""

from dataclasses import dataclass, replace

import numpy as np

from ..control.linear_law import LinearLaw
from ..engine import periods
from ..linear.equilibria import Equilibria, slopes
from ..linear.sampling import hold_matrices
from ..plant import Plant

_LOWEST, _POINTS = 0.05, 400  # Hz, frequencies up to Nyquist's
_SHARP = 3.0  # Ms of a peak that may lie between two of them
_ROUNDS, _INSIDE = 4, 9  # in which it is sought, by so many points each


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


@dataclass(frozen=True)
class SampledLanes:
    """Plants linearised and sampled in lanes: A [lanes, n, n], B [lanes, n, 1], C [lanes, m, n], D [lanes, m, 1].

    From the held command to `measures`; commands on their way are further states. `responses`: of the measured signals
    at frequencies f [k] in Hz up to Nyquist's, complex [lanes, m, k].
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    measures: tuple[str, ...]
    f: np.ndarray
    responses: np.ndarray
    period: float

    def measured(self, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """C, D and responses of some of the measures."""
        rows = [self.measures.index(name) for name in names]
        return self.c[:, rows], self.d[:, rows], self.responses[:, rows]


def sampled_lanes(
    plant: Plant, points: Equilibria, p: np.ndarray, measures: tuple[str, ...], period: float
) -> SampledLanes:
    """Plants with parameters p [lanes, k] about `points`, the command held over each `period` [s], late as declared."""
    whole, part = periods(plant.lateness(), period)
    prompt = _sampled(plant, measures, points, p, period, part)
    f = np.geomspace(_LOWEST, 0.5 / period, _POINTS)
    z = np.exp(2j * np.pi * f * period)
    return SampledLanes(*_behind(*prompt, whole), measures, f, _responses(*prompt, z) * z**-whole, period)


def lane_margins(lanes: SampledLanes, law: LinearLaw) -> LaneMargins:
    """The loops of a law on sampled plants.

    The margins are read on a fixed grid of frequencies; Ms above 3, a sharp peak, is sought between its points.
    """
    c, d, responses = lanes.measured(law.measures)
    radius = np.abs(np.linalg.eigvals(_closed(lanes.a, lanes.b, c, d, law))).max(axis=1)
    loop = -np.einsum("fm,lmf->lf", _gains(law, lanes.f, lanes.period)[:, 1:], responses)
    stable, level = radius < 1 - 1e-9, 1 / np.abs(1 + loop)
    ms, margin = level.max(axis=1), _gain_margin(loop)
    sharp = np.flatnonzero(stable & (ms > _SHARP))
    if sharp.size:
        some = replace(lanes, a=lanes.a[sharp], b=lanes.b[sharp], c=lanes.c[sharp], d=lanes.d[sharp])
        ms[sharp] = np.maximum(ms[sharp], _sought(some, law, np.argmax(level[sharp], axis=1)))
    return LaneMargins(radius, np.where(stable, ms, np.nan), np.where(stable, margin, np.nan))


def _sought(lanes: SampledLanes, law: LinearLaw, largest: np.ndarray) -> np.ndarray:
    """Ms [lanes] between the neighbours of each lane's `largest` point of the grid, ever closer."""
    c, d, _ = lanes.measured(law.measures)
    last, n = len(lanes.f) - 1, lanes.a.shape[1]
    low, high = lanes.f[np.maximum(largest - 1, 0)], lanes.f[np.minimum(largest + 1, last)]
    every, level = np.arange(len(largest)), np.zeros((len(largest), 1))
    for _ in range(_ROUNDS):
        f = np.geomspace(low, high, _INSIDE, axis=1)
        z = np.exp(2j * np.pi * f * lanes.period)
        x = np.linalg.solve(z[..., None, None] * np.eye(n) - lanes.a[:, None], lanes.b[:, None])
        measured = (c[:, None] @ x + d[:, None])[..., 0]
        gains = _gains(law, f.ravel(), lanes.period)[:, 1:].reshape(measured.shape)
        level = 1 / np.abs(1 - np.sum(gains * measured, axis=2))
        best = np.argmax(level, axis=1)
        low, high = f[every, np.maximum(best - 1, 0)], f[every, np.minimum(best + 1, _INSIDE - 1)]
    return level.max(axis=1)


_Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _sampled(
    plant: Plant, measures: tuple[str, ...], points: Equilibria, p: np.ndarray, period: float, part: float
) -> _Matrices:
    """A, B, C, D in lanes of `measures` of a held command that arrives a `part` of a period late."""
    a, b, c, d = slopes(plant, points.x, points.u, p)
    rows = [plant.output(name) for name in measures]
    b, c, d = b[:, :, :1], c[:, rows], d[:, rows, :1]
    after, newer = hold_matrices(a, b, (1 - part) * period)
    if not part:
        return after, newer, c, d
    before, older = hold_matrices(a, b, part * period)
    ahead = np.concatenate((after @ before, after @ older), axis=2)  # the command before is a further state
    ahead = np.pad(ahead, ((0, 0), (0, 1), (0, 0)))
    newer = np.pad(newer, ((0, 0), (0, 1), (0, 0)))
    newer[:, -1] = 1.0
    return ahead, newer, np.concatenate((c, d), axis=2), np.zeros_like(d)


def _behind(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, whole: int) -> _Matrices:
    """The same with the command so many whole periods later: those on their way are further states, newest first."""
    if not whole:
        return a, b, c, d
    lanes, n = len(a), a.shape[1]
    ahead = np.zeros((lanes, n + whole, n + whole))
    ahead[:, :n, :n], ahead[:, :n, [-1]] = a, b
    ahead[:, n + 1 :, n:-1] = np.eye(whole - 1)
    entering = np.zeros((lanes, n + whole, 1))
    entering[:, n] = 1.0
    leaving = np.concatenate((c, np.zeros((*c.shape[:2], whole - 1)), d), axis=2)
    return ahead, entering, leaving, np.zeros_like(d)


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


def _responses(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Responses at z [k] of what is measured [lanes, m, k], by the modes of each lane."""
    modes, right = np.linalg.eig(a)
    entering = np.linalg.solve(right, b.astype(complex))[:, :, 0]
    return np.einsum("lmn,lnf->lmf", (c @ right) * entering[:, None], 1 / (z - modes[..., None])) + d


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
