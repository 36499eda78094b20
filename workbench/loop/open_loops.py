"""Open loops in lanes over frequency, closest where something happens, and the margins that they leave."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

LOWEST = 1e-4  # Hz: crossings of the slowest loop that any controller allows
_ZERO = np.array([1e-6, 2e-6])  # Hz: where a loop is the same at both, that is its value at 0
_FLAT = 0.1  # of the loop: by no more do both differ then
_SLOW, _DECADE = 0.05, 60  # Hz: points in a decade from there on, a fifth of them below
_MODE = np.sinh(np.linspace(-4.0, 4.0, 16))  # half widths of a resonance, from its middle, at which it is looked at
_LIGHT = 0.15  # damping above which the grid is close enough
_SHARPEST = 1e-6  # half width of a resonance over its frequency: that of an undamped one
_ROUNDS, _INSIDE = 2, 5  # each splits the intervals in which something happens by so many points
_HIDDEN, _FELT = 0.3, 0.5  # of unit gain, and of the largest sensitivity: a lower peak cannot reach it between points
_INFINITE = 1e100
_FARTHEST_DB = 120.0  # a crossing farther from the critical point is none

Response = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of lanes [n] at frequencies [n, k] in Hz: complex [n, k]
Block = tuple[np.ndarray, np.ndarray, np.ndarray]  # of loops: lanes [n], frequencies [n, k] and values [n, k]


@dataclass(frozen=True)
class OpenLoops:
    """Loops of lanes, broken at the command, as blocks: all of them on their grids, then what happens between.

    The last block has every crossing; Ms is the largest of all.
    """

    blocks: list[Block]

    @property
    def margins(self) -> np.ndarray:
        """Ms, gain margin [dB] and phase margin [deg] of each: [3, lanes]."""
        return np.array((self.ms, self.gain_margin_db, self.phase_margin_deg))

    @property
    def ms(self) -> np.ndarray:
        """Largest |1/(1 + L)| [lanes]."""
        largest = np.zeros(len(self.blocks[0][0]))
        for lane, _, loop in self.blocks:
            np.maximum.at(largest, lane, _sensitivity(loop))
        return largest

    @property
    def gain_margin_db(self) -> np.ndarray:
        """Least gain margin [dB] in either direction [lanes], also at 0 and at the highest frequency; NaN where the
        loop does not cross the negative real axis within 120 dB."""
        lane, _, loop = self.blocks[-1]
        rows, i = np.nonzero(_changes(np.imag(loop) >= 0))
        before, after = loop[rows, i], loop[rows, i + 1]
        angles = np.angle(-before), np.angle(-after)
        sizes, span = _log(before), angles[0] - angles[1]
        at = sizes + angles[0] / np.where(span == 0, 1, span) * (_log(after) - sizes)
        negative = np.abs(span) < np.pi  # a half turn and more crosses the positive one
        (_, f, whole), ends = self.blocks[0], []
        first, second, last = whole[:, 0], whole[:, 1], whole[:, -1]
        flat = (f[:, 1] <= _ZERO[1]) & (np.abs(first - second) <= _FLAT * np.abs(first))
        for value, counts in ((first, flat), (last, True)):
            ends.append(np.where((np.real(value) < 0) & counts, _log(np.real(value)), np.inf))
        least = np.min(np.abs(ends), axis=0)
        np.minimum.at(least, lane[rows[negative]], np.abs(at[negative]))
        least *= 20 / np.log(10)
        return np.where(least <= _FARTHEST_DB, least, np.nan)

    @property
    def phase_margin_deg(self) -> np.ndarray:
        """Least phase margin [deg] in either direction [lanes]; NaN where the loop does not cross unit gain."""
        lane, _, loop = self.blocks[-1]
        rows, i = np.nonzero(_changes(np.abs(loop) >= 1))
        before, after = loop[rows, i], loop[rows, i + 1]
        part = _log(before) / (_log(before) - _log(after))
        at = np.angle(-before) + part * np.angle(after * before.conj())
        least = np.full(len(self.blocks[0][0]), np.inf)
        np.minimum.at(least, lane[rows], np.abs(np.degrees(np.angle(np.exp(1j * at)))))
        return np.where(np.isfinite(least), least, np.nan)

    def curve(self, lane: int) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies [k] in Hz, from the lowest that is shown, and the loop of a lane there [k]."""
        f, loop = (
            np.concatenate([values[i][lanes == lane].ravel() for lanes, *values in self.blocks]) for i in range(2)
        )
        f, first = np.unique(f, return_index=True)
        shown = f >= LOWEST
        return f[shown], loop[first[shown]]


def opened(
    response: Response, f: np.ndarray, loop: np.ndarray, rounds: int = _ROUNDS, inside: int = _INSIDE
) -> OpenLoops:
    """Loops [lanes, k] at frequencies [lanes, k] in Hz, and between them where they cross the real axis or unit gain,
    come nearest to -1, or may do so unseen: each round splits such intervals by `inside` points."""
    lane, part = np.arange(len(f)), np.arange(1, inside + 1) / (inside + 1)
    loop = _finite(loop)
    blocks, peak = [(lane, f, loop)], _sensitivity(loop)
    for _ in range(rounds):
        rows, low, high = _events(loop, peak[lane])
        ends = f[rows, low, None], f[rows, high, None]
        values = loop[rows, low, None], loop[rows, high, None]
        lane = lane[rows]
        between = ends[0] * (ends[1] / ends[0]) ** part
        f = np.concatenate((ends[0], between, ends[1]), axis=1)
        loop = np.concatenate((values[0], _finite(response(lane, between)), values[1]), axis=1)
        blocks.append((lane, f, loop))
    return OpenLoops(blocks)


def grid(period: float) -> np.ndarray:
    """Frequencies [k] in Hz that all loops of a `period` [s] have: close to 0, and up to Nyquist's."""
    highest = 0.5 / period
    slow, fast = _DECADE / 5 * np.log10(_SLOW / LOWEST), _DECADE * np.log10(highest / _SLOW)
    even = np.geomspace(LOWEST, _SLOW, round(slow), endpoint=False), np.geomspace(_SLOW, highest, max(2, round(fast)))
    return np.concatenate((_ZERO, *even))


def near(poles: np.ndarray, period: float) -> np.ndarray:
    """Frequencies [lanes, k] in Hz below Nyquist's about those at which poles z [lanes, n] resonate lightly, as close
    as they are sharp; the lowest and the highest stand for none."""
    with np.errstate(divide="ignore"):
        turn, width = np.angle(poles), np.abs(np.log(np.abs(poles)))
    light = (turn > 0) & (width < _LIGHT * turn)
    some = np.argsort(~light, axis=1, kind="stable")[:, : light.sum(axis=1).max(initial=0)]
    turn, width, light = (np.take_along_axis(part, some, axis=1) for part in (turn, width, light))
    turn, width = np.where(light, turn, 0.0), np.where(light, np.maximum(width, _SHARPEST * turn), 0.0)
    f = (turn[..., None] + width[..., None] * _MODE) / (2 * np.pi * period)
    return np.clip(f.reshape(len(poles), -1), LOWEST, 0.5 / period)


def unit_circle(f: np.ndarray, period: float) -> np.ndarray:
    """z of frequencies [Hz]."""
    return np.exp(2j * np.pi * f * period)


def _events(loop: np.ndarray, peak: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows and points of open loops [n, k] between which to look closer: where a loop crosses unit gain or the negative
    real axis, and beside extremes that may hide such a crossing or be its `peak` [n] of sensitivity."""
    re, im = np.real(loop), np.imag(loop)
    size = re**2 + im**2
    gap, aside = size + 2 * re + 1, np.abs(im)
    crosses = _changes(size >= 1) | (_changes(im >= 0) & ((re[:, 1:] < 0) | (re[:, :-1] < 0)))
    (gap_falls, gap_rises), (size_falls, size_rises), (aside_falls, aside_rises) = map(_slopes, (gap, size, aside))
    middle = slice(1, -1)
    turns = gap_falls & gap_rises & (gap[:, middle] * (_FELT * peak[:, None]) ** 2 < 1)
    turns |= size_falls & size_rises & (size[:, middle] > 1)
    turns |= ~size_falls & ~size_rises & (size[:, middle] < 1) & (size[:, middle] > _HIDDEN**2)
    alike = (im[:, :-2] >= 0) == (im[:, 2:] >= 0)
    turns |= aside_falls & aside_rises & alike & (aside[:, middle] < -_HIDDEN * re[:, middle])
    (rows, i), (others, j) = np.nonzero(crosses), np.nonzero(turns)
    return np.append(rows, others), np.append(i, j), np.append(i + 1, j + 2)


def _slopes(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether values [n, k] fall before, and rise after, each of their k - 2 inner points."""
    rises = values[:, 1:] >= values[:, :-1]
    return ~rises[:, :-1], rises[:, 1:]


def _changes(what: np.ndarray) -> np.ndarray:
    return what[:, 1:] != what[:, :-1]


def _finite(loop: np.ndarray) -> np.ndarray:
    """An infinite loop is a large one."""
    return np.where(np.isfinite(loop), loop, _INFINITE)


def _sensitivity(loop: np.ndarray) -> np.ndarray:
    """The largest [n] of rows [n, k]."""
    with np.errstate(divide="ignore"):
        return 1 / np.abs(1 + loop).min(axis=1, initial=np.inf)


def _log(loop: np.ndarray) -> np.ndarray:
    """log |L|; a loop that is 0 is a small one."""
    return np.log(np.maximum(np.abs(loop), 1 / _INFINITE))
