"""Linear loops of laws on many plants: poles, largest sensitivity and margins, lane by lane."""

from dataclasses import dataclass

import numpy as np

from ..engine import LaneDelays
from ..linear.equilibria import Equilibria, slopes
from ..linear.sampling import hold_matrices
from ..linear.state_space import Matrices
from ..plant import Plant
from .lane_laws import LawLanes
from .margins import STABLE

_LOWEST, _POINTS = 0.05, 400  # Hz, frequencies up to Nyquist's
_SHARP = 3.0  # Ms of a peak that may lie between two of them
_ROUNDS, _INSIDE = 4, 9  # in which it is sought, by so many points each


@dataclass(frozen=True)
class LaneMargins:
    """Largest |z| of the poles [lanes]; Ms [1], gain margin [dB] and phase margin [deg] in either direction.

    An unstable loop has NaN for all three, and a loop without such a crossing for a margin.
    """

    radius: np.ndarray
    ms: np.ndarray
    gain_margin_db: np.ndarray
    phase_margin_deg: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """Bool [lanes]."""
        return self.radius < STABLE

    def where(self, ok: np.ndarray, radius: float) -> "LaneMargins":
        """Those of the lanes that are `ok`, the others being unstable with a `radius`."""
        columns = (self.ms, self.gain_margin_db, self.phase_margin_deg)
        return LaneMargins(np.where(ok, self.radius, radius), *(np.where(ok, column, np.nan) for column in columns))

    def some(self, lanes: np.ndarray) -> "LaneMargins":
        """Those of some lanes."""
        columns = (self.radius, self.ms, self.gain_margin_db, self.phase_margin_deg)
        return LaneMargins(*(column[lanes] for column in columns))


@dataclass(frozen=True)
class ModalResponse:
    """residues [lanes, m, n] / (z - modes [lanes, n]), summed, + direct [lanes, m, 1]; all `late` periods later: one
    number, or [lanes, 1, 1]."""

    modes: np.ndarray
    residues: np.ndarray
    direct: np.ndarray
    late: int | np.ndarray

    def at(self, z: np.ndarray) -> np.ndarray:
        """The response at z [k], or at a lane's own z [lanes, k]: complex [lanes, m, k]."""
        z = z[..., None, :]
        return (self.residues @ (1 / (z - self.modes[..., None])) + self.direct) * z**-self.late

    def some(self, lanes: np.ndarray, rows: list[int]) -> "ModalResponse":
        """That of some lanes to some of the m outputs."""
        late = self.late if isinstance(self.late, int) else self.late[lanes]
        return ModalResponse(self.modes[lanes], self.residues[lanes][:, rows], self.direct[lanes][:, rows], late)


@dataclass(frozen=True)
class SampledLanes:
    """Plants linearised and sampled in lanes: A [lanes, n, n], B [lanes, n, 1], C [lanes, m, n], D [lanes, m, 1].

    From the held command to `measures`; commands on their way are further states. `modal`: the same as a response,
    and `responses` at frequencies f [k] in Hz up to Nyquist's, complex [lanes, m, k].
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    measures: tuple[str, ...]
    period: float
    modal: ModalResponse
    f: np.ndarray
    responses: np.ndarray


def sampled_lanes(
    plant: Plant, points: Equilibria, p: np.ndarray, measures: tuple[str, ...], period: float
) -> SampledLanes:
    """Plants with parameters p [lanes, k] about `points`, the command held for a `period` [s], late as each says."""
    delays = LaneDelays.of(plant.lane_lateness(p), period)
    late = delays.whole[:, None, None] if delays.differ else int(delays.whole[0])
    part = delays.part[:, None, None] if delays.differ else delays.part[:1]
    prompt = _sampled(plant, measures, points, p, period, part)
    modal, f = _modal(*prompt, late), np.geomspace(_LOWEST, 0.5 / period, _POINTS)
    return SampledLanes(*_behind(*prompt, delays.taps), measures, period, modal, f, modal.at(_z(f, period)))


def lane_margins(lanes: SampledLanes, law: LawLanes) -> LaneMargins:
    """The loops of a controller's linear views (`lane_laws`) on sampled plants.

    The margins are read on a fixed grid of frequencies; Ms above 3, a sharp peak, is sought between its points.
    """
    rows = [lanes.measures.index(name) for name in law.measures]
    radius = np.abs(np.linalg.eigvals(_closed(lanes.a, lanes.b, lanes.c[:, rows], lanes.d[:, rows], law))).max(axis=1)
    loop = _broken(lanes, law, lanes.f, lanes.responses)
    stable, level = radius < STABLE, 1 / np.abs(1 + loop)
    ms = level.max(axis=1)
    sharp = np.flatnonzero(stable & (ms > _SHARP))
    if sharp.size:
        peak = _sought(lanes, law.some(sharp), lanes.modal.some(sharp, rows), np.argmax(level[sharp], axis=1))
        ms[sharp] = np.maximum(ms[sharp], peak)
    columns = (np.where(stable, column, np.nan) for column in (ms, _gain_margin(loop), _phase_margin(loop)))
    return LaneMargins(radius, *columns)


def open_loops(lanes: SampledLanes, law: LawLanes, f: np.ndarray) -> np.ndarray:
    """The same loops broken at the command, complex [lanes, k] at frequencies [k] in Hz; -1 is the critical point."""
    return _broken(lanes, law, f, lanes.modal.at(_z(f, lanes.period)))


def _broken(lanes: SampledLanes, law: LawLanes, f: np.ndarray, responses: np.ndarray) -> np.ndarray:
    rows = [lanes.measures.index(name) for name in law.measures]
    return -np.sum(law.gains(_z(f, lanes.period)) * responses[:, rows], axis=1)


def _z(f: np.ndarray, period: float) -> np.ndarray:
    return np.exp(2j * np.pi * f * period)


def _sought(lanes: SampledLanes, law: LawLanes, modal: ModalResponse, largest: np.ndarray) -> np.ndarray:
    """Ms of some lanes between the neighbours of each one's `largest` point of the grid, ever closer."""
    last = len(lanes.f) - 1
    low, high = lanes.f[np.maximum(largest - 1, 0)], lanes.f[np.minimum(largest + 1, last)]
    every, level = np.arange(len(largest)), np.zeros((len(largest), 1))
    for _ in range(_ROUNDS):
        f = np.geomspace(low, high, _INSIDE, axis=1)
        z = _z(f, lanes.period)
        level = 1 / np.abs(1 - np.sum(law.gains(z) * modal.at(z), axis=1))
        best = np.argmax(level, axis=1)
        low, high = f[every, np.maximum(best - 1, 0)], f[every, np.minimum(best + 1, _INSIDE - 1)]
    return level.max(axis=1)


def _sampled(
    plant: Plant, measures: tuple[str, ...], points: Equilibria, p: np.ndarray, period: float, part: np.ndarray
) -> Matrices:
    """A, B, C, D in lanes of `measures` of a command, held over each period, that arrives a `part` of one late.

    The part is [1] or [lanes, 1, 1].
    """
    a, b, c, d = slopes(plant, points.x, points.u, p)
    rows = [plant.output(name) for name in measures]
    b, c, d = b[:, :, :1], c[:, rows], d[:, rows, :1]
    after, newer = hold_matrices(a, b, (1 - part) * period)
    if not part.any():
        return after, newer, c, d
    before, older = hold_matrices(a, b, part * period)
    ahead = np.concatenate((after @ before, after @ older), axis=2)  # the command before is a further state
    ahead = np.pad(ahead, ((0, 0), (0, 1), (0, 0)))
    newer = np.pad(newer, ((0, 0), (0, 1), (0, 0)))
    newer[:, -1] = 1.0
    return ahead, newer, np.concatenate((c, d), axis=2), np.zeros_like(d)


def _behind(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, taps: np.ndarray) -> Matrices:
    """The same with the command late by the whole periods at which `taps` [lanes, periods + 1] are 1: those on their
    way are further states, newest first."""
    lanes, n, whole = len(a), a.shape[1], taps.shape[1] - 1
    if not whole:
        return a, b, c, d
    arriving = taps[:, None]
    ahead = np.zeros((lanes, n + whole, n + whole))
    ahead[:, :n, :n], ahead[:, :n, n:] = a, b @ arriving[..., 1:]
    ahead[:, n + 1 :, n:-1] = np.eye(whole - 1)
    entering = np.zeros((lanes, n + whole, 1))
    entering[:, :n], entering[:, n] = b @ arriving[..., :1], 1.0
    leaving = np.concatenate((c, d @ arriving[..., 1:]), axis=2)
    return ahead, entering, leaving, d @ arriving[..., :1]


def _closed(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, law: LawLanes) -> np.ndarray:
    """The loop's own matrix in lanes."""
    gains, entering = law.d[:, None, 1:], law.b[:, :, 1:]
    inner = 1 - gains @ d  # the law's own command may reach what it measures at once
    u_x, u_w = (gains @ c) / inner, law.c[:, None] / inner
    y_x, y_w = c + d @ u_x, d @ u_w
    top = np.concatenate((a + b @ u_x, b @ u_w), axis=2)
    bottom = np.concatenate((entering @ y_x, law.a + entering @ y_w), axis=2)
    return np.concatenate((top, bottom), axis=1)


def _modal(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, late: int | np.ndarray) -> ModalResponse:
    modes, right = np.linalg.eig(a)
    entering = np.linalg.solve(right, b.astype(complex))[:, :, 0]
    return ModalResponse(modes, (c @ right) * entering[:, None], d, late)


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


def _phase_margin(loop: np.ndarray) -> np.ndarray:
    """Least |phase margin| [deg] where the loop crosses unit gain."""
    with np.errstate(divide="ignore"):  # a plant without a supply does not answer
        size = np.log(np.abs(loop))
    lane, i = np.nonzero(np.signbit(size[:, 1:]) != np.signbit(size[:, :-1]))
    around = np.clip(i[:, None] + np.arange(-1, 3), 0, loop.shape[1] - 1)  # a cubic of the four points about it
    sizes, points = size[lane[:, None], around], loop[lane[:, None], around]
    turned = np.unwrap(np.angle(points / points[:, 1:2]), axis=1)
    part = sizes[:, 1] / (sizes[:, 1] - sizes[:, 2])
    for _ in range(3):
        slope = (_cubic(sizes, part + 0.01) - _cubic(sizes, part - 0.01)) / 0.02
        part = np.clip(part - _cubic(sizes, part) / np.where(slope == 0, np.inf, slope), 0.0, 1.0)
    least = np.full(len(loop), np.inf)
    at = np.angle(-points[:, 1]) + _cubic(turned, part)
    np.minimum.at(least, lane, np.abs(np.degrees(np.angle(np.exp(1j * at)))))
    return np.where(np.isfinite(least), least, np.nan)


def _cubic(y: np.ndarray, t: np.ndarray) -> np.ndarray:
    """At t [k] the cubics through y [k, 4] at -1, 0, 1 and 2 (Lagrange's form)."""
    weights = (
        -t * (t - 1) * (t - 2) / 6,
        (t + 1) * (t - 1) * (t - 2) / 2,
        -(t + 1) * t * (t - 2) / 2,
        (t + 1) * t * (t - 1) / 6,
    )
    return np.sum(y * np.stack(weights, axis=1), axis=1)
