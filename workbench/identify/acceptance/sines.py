"""Sines in recordings: where one is steady, its frequency, and other signals as complex amplitudes of it."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.optimize import least_squares

from ...base.errors import InputError
from ...records import Record

_GROUPS = 8  # of whole cycles, whose scatter says how well an amplitude is known
_REST, _MOVES = 0.3, 0.05  # s, and of a record's largest range: what goes less far for so long is at rest
_SHORTEST = 0.1  # s of motion
_STEADY = (0.4, 0.75)  # of a sine: before, it settles; after, what comes to rest slowly counts as motion still


@dataclass(frozen=True)
class SineCriteria:
    """How much of a sine's variance may be something else, and how many cycles it has at least."""

    other: float
    cycles: int


PLAYED = SineCriteria(0.01, 6)  # of what is played: of a triangle 0.014 is something else
ANSWERED = SineCriteria(0.05, 9)  # of a force, which a valve's lap distorts: of a square 0.19 is


@dataclass(frozen=True, eq=False)
class SteadySine:
    """Rows first to last (exclusive) of a record, through which a sine of f [Hz] is steady."""

    record: Record
    first: int
    last: int
    f: float

    def amplitudes(self, signal: str) -> np.ndarray:
        """Complex amplitudes [k] of a signal in groups of whole cycles, a drift through all of them taken off."""
        t, y = self.record.t[self.first : self.last], self.record.signals[signal][self.first : self.last]
        t = t - t[0]
        y = y - np.linalg.lstsq(_columns(t, self.f), y)[0][3] * t
        cycles = max(1, int(self.f * t[-1] / _GROUPS))
        count = int(self.f * t[-1] / cycles)
        edges = np.searchsorted(t, np.arange(count + 1) * cycles / self.f - 1e-9)
        return np.array([_amplitude(t[a:b], y[a:b], self.f) for a, b in pairwise(edges)])

    @property
    def where(self) -> str:
        """For a complaint."""
        return sine_place(self.record, self.first, self.last)


def sine_place(record: Record, first: int, last: int) -> str:
    """For a complaint: the record and its times."""
    return f"record {record.name}: from {record.t[first]:.3g} to {record.t[last - 1]:.3g} s"


def frequency(t: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Frequency [Hz] of the sine that explains y [k] over t [k] s best, and the share of the variance that it lacks."""
    spectrum = np.abs(np.fft.rfft(y - y.mean(), 8 * y.size))
    guess = float(np.argmax(spectrum)) / (8 * y.size * float(np.mean(np.diff(t))))

    def left(numbers: np.ndarray) -> np.ndarray:
        columns = _columns(t, float(numbers[0]))
        return y - columns @ np.linalg.lstsq(columns, y)[0]

    found = least_squares(left, [guess], x_scale=0.01 * guess)
    f = float(found.x[0])
    return f, float(np.var(left(found.x)) / np.var(y))


def check_sine(
    record: Record, first: int, last: int, found: tuple[float, float], demand: SineCriteria, what: str
) -> None:
    """Raises InputError for rows whose `frequency` found no sine in them, and for too few cycles."""
    f, other = found
    if other > demand.other:
        told = f"{what} is no sine, {100 * other:.2g} % of it is something else"
        raise InputError(f"{sine_place(record, first, last)}: {told}; play sines with rests between")
    cycles = f * (record.t[last - 1] - record.t[first])
    if cycles < demand.cycles:
        told = f"{cycles:.2g} cycles at {f:.3g} Hz; {demand.cycles} are needed, for it to settle"
        raise InputError(f"{sine_place(record, first, last)}: {told}")


def steady_sines(record: Record, signal: str, noise: float) -> list[SteadySine]:
    """The steady part of each sine that a signal does between rests; `noise` is its sensor's standard deviation.

    A rest lasts 0.3 s, in which the signal goes less than 5 % of the record's largest range. Raises InputError for what
    is no sine, for too few cycles, and for a record that does not move.
    """
    blocks = _moving(record, signal, noise)
    if not blocks:
        raise InputError(f"record {record.name}: no sine in it: its {signal} stands still")
    found = []
    for first, last in blocks:
        steady, end = (first + round(share * (last - first)) for share in _STEADY)
        t, y = record.t[steady:end] - record.t[steady], record.signals[signal][steady:end]
        f, other = frequency(t, y)
        check_sine(record, first, last, (f, other - noise**2 / float(np.var(y))), ANSWERED, f"the {signal}")
        found.append(SteadySine(record, steady, end, f))
    return found


def _moving(record: Record, signal: str, noise: float) -> list[tuple[int, int]]:
    y, rows = record.signals[signal], max(3, round(_REST / record.period))
    span = maximum_filter1d(y, rows, mode="nearest") - minimum_filter1d(y, rows, mode="nearest")
    moves = span > max(_MOVES * float(span.max()), 10 * noise)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], moves.astype(int), [0]))))
    half, least = rows // 2, _SHORTEST / record.period
    blocks = [
        (int(a) + half * (a > 0), int(b) - half * (b < y.size)) for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]  # what moves is seen half of a rest before and after it does
    return [(a, b) for a, b in blocks if b - a > least]


def _columns(t: np.ndarray, f: float) -> np.ndarray:
    turn = 2 * np.pi * f * t
    return np.column_stack((np.sin(turn), np.cos(turn), np.ones_like(turn), t))


def _amplitude(t: np.ndarray, y: np.ndarray, f: float) -> complex:
    """The amplitude against a sine of phase 0 at t = 0; positive imaginary part: it leads."""
    sine, cosine, _ = np.linalg.lstsq(_columns(t, f)[:, :3], y)[0]
    return complex(sine, cosine)
