"""What a valve does in time: its steps, and its frequency response by sines or by a multisine."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri, stdtrit

from ...base.errors import InputError
from ...base.gain_phase import gain_db, phase_deg
from ...linear.crossings import corner_frequency
from ...records import Record
from ..data import measured_response
from .row import Row, unsaid
from .sines import PLAYED, SteadySine, check_sine, frequency

STEPS, SINES = (10, 50, 100), (5, 25, 100)  # % of full command
_REST = 5  # periods of sampling without a move of the command, which end a plateau or a sine
_STILL, _STILL_SHARE = 1e-4, 1e-3  # of full command, and of the largest: what moves by less in a row stands still
_SETTLED = 0.03  # of the step: how far the last two fifths of a plateau may differ
_COHERENT = 0.9


@dataclass(frozen=True)
class ResponseEstimate:
    """Complex response [k] at f [k] Hz, and the 95 % circle about each [k]."""

    f: np.ndarray
    response: np.ndarray
    radius: np.ndarray


def corner_rows(response: ResponseEstimate | None, stem: str, what: str, reason: str) -> list[Row]:
    """Rows of the frequencies [Hz] at which the gain is 3 dB below its first and the phase passes -90 deg.

    Low and high are where the edges of the band pass. Null where the response does not reach there.
    """
    meanings = {"f3db": f"{what}: -3 dB", "f90": f"{what}: -90 deg"}
    if response is None or response.f.size < 2:
        return [unsaid(f"{stem}_{key}", meaning, "Hz", reason) for key, meaning in meanings.items()]
    size = np.abs(response.response)
    share = np.minimum(response.radius / np.maximum(size, 1e-300), 0.999)
    level, half = gain_db(response.response / size[0]), np.degrees(np.arcsin(share))
    wide = np.minimum(np.hypot(share, share[0]), 0.999)  # the first gain is not known either
    up, down = 20 * np.log10(1 + wide), 20 * np.log10(1 - wide)
    phase = phase_deg(response.response)
    bands = {"f3db": (level, level + down, level + up, -3.0), "f90": (phase, phase - half, phase + half, -90.0)}
    return [_corner(f"{stem}_{key}", meanings[key], response.f, *bands[key]) for key in meanings]


def _corner(
    id: str, meaning: str, f: np.ndarray, middle: np.ndarray, under: np.ndarray, over: np.ndarray, level: float
) -> Row:
    value, low, high = (corner_frequency(f, each, level) for each in (middle, under, over))
    if value is None:
        return unsaid(id, meaning, "Hz", f"not reached from {f[0]:.3g} to {f[-1]:.3g} Hz")
    return Row(id, meaning, "Hz", value, low, f[-1] if high is None else high)


def multisine_response(record: Record, output: str) -> ResponseEstimate | None:
    """The response of a record that excites the command broadly; None where little of it is coherent."""
    try:
        found = measured_response(record, "command", output)
    except InputError:
        return None
    good = found.coherence >= _COHERENT
    if good.sum() < 5:
        return None
    return ResponseEstimate(found.f[good], found.response[good], found.radius[good])


def sine_response(record: Record, output: str) -> ResponseEstimate:
    """The response of a record of one sine after another, rests between them. Raises InputError for what is none."""
    blocks = [block for block in _moving(record) if block[1] - block[0] > 2 * _REST]
    if not blocks:
        does = "goes by jumps" if np.ptp(record.signals["command"]) > 0 else "stands still"
        raise InputError(f"record {record.name}: no sine in it: the command {does}; play sines with rests between")
    points = sorted((_sine(record, output, *block) for block in blocks), key=lambda point: point[0])
    f, response, radius = (np.array(column) for column in zip(*points, strict=True))
    return ResponseEstimate(f, response, radius)


def _sine(record: Record, output: str, first: int, last: int) -> tuple[float, complex, float]:
    t, u = record.t[first:last] - record.t[first], record.signals["command"][first:last]
    f, other = frequency(t, u)
    check_sine(record, first, last, (f, other), PLAYED, "the command")
    steady = SteadySine(record, (first + last) // 2, last, f)  # the first half is for the answer to become periodic
    held = np.sinc(f * record.period) * np.exp(-1j * np.pi * f * record.period)  # what a drive holds for each period
    into, out = held * steady.amplitudes("command"), steady.amplitudes(output)
    scatter = float(np.sqrt(np.sum(np.abs(out - out.mean()) ** 2) / (out.size - 1) / out.size))
    reach = float(np.sqrt(fdtri(2, 2 * out.size - 2, 0.95)))
    return f, complex(out.mean() / into.mean()), reach * scatter / float(abs(into.mean()))


def _moving(record: Record) -> list[tuple[int, int]]:
    """First and last (exclusive) rows of what moves between rests of the command."""
    u = record.signals["command"]
    still = np.concatenate(([True], np.abs(np.diff(u)) < min(_STILL, _STILL_SHARE * float(np.abs(u).max()))))
    count = np.convolve(still.astype(int), np.ones(_REST, int), mode="full")[: still.size]
    resting = count == _REST
    edges = np.flatnonzero(np.diff(np.concatenate(([0], (~resting).astype(int), [0]))))
    late = _REST - 1  # rows of rest before it counts as one
    ends = [int(b) - late * (b < u.size) for b in edges[1::2]]
    return [(max(0, int(a) - 1), b) for a, b in zip(edges[::2], ends, strict=True)]


def step_rows(records: Mapping[int, Record], output: str, noise: float, dwell: str) -> list[Row]:
    """Time to 90 % and overshoot of the steps [%] that there are; the others null. Raises InputError for a dwell that
    is too short."""
    rows = []
    for size in STEPS:
        ids = {"t90": ("s", f"step of {size} %: to 90 % of it"), "overshoot": ("%", f"step of {size} %: overshoot")}
        if size not in records:
            rows += [unsaid(f"step_{size}_{key}", meaning, unit, dwell) for key, (unit, meaning) in ids.items()]
            continue
        times, overs = step_figures(records[size], output, noise)
        for (key, (unit, meaning)), (value, low, high) in zip(ids.items(), (times, overs), strict=True):
            rows.append(Row(f"step_{size}_{key}", meaning, unit, value, low, high))
    return rows


Figure = tuple[float, float, float]


def step_figures(record: Record, output: str, noise: float) -> tuple[Figure, ...]:
    """Time to 90 % [s] and overshoot [%] of a record's steps, each with low and high: scatter, sampling and noise.

    Raises InputError where a plateau is too short for the answer to settle, and where there is no step.
    """
    u, y, t = record.signals["command"], record.signals[output], record.t
    jumps = np.flatnonzero(np.abs(np.diff(u)) > 0.5 * np.ptp(u) / 2) + 1
    if not jumps.size:
        raise InputError(f"record {record.name}: no step in it: no jump of the command")
    pieces = list(zip(jumps, np.append(jumps[1:], t.size), strict=True))
    figures = np.array([_one_step(record, y, int(first), int(last), noise) for first, last in pieces])
    time, over, size, rows = figures.mean(axis=0)
    share = noise / (0.9 * size)
    reach_t = record.period / 2 + 2 * share * time + _scatter(figures[:, 0])
    reach_o = 200 * share * np.sqrt(2 * np.log(max(2.0, rows))) + _scatter(figures[:, 1])
    return tuple((v, max(0.0, v - reach), v + reach) for v, reach in ((time, reach_t), (over, reach_o)))


def _one_step(record: Record, y: np.ndarray, first: int, last: int, noise: float) -> tuple[float, float, float, int]:
    """Time to 90 % [s], overshoot [%], size, and rows of one step."""
    held, fifth = y[first:last], (last - first) // 5
    if fifth < 2:
        raise InputError(_short(record, record.t[first], held.size))
    before, settled = float(np.mean(y[max(0, first - 20) : first])), float(np.mean(held[-fifth:]))
    size = settled - before
    if abs(float(np.mean(held[-2 * fifth : -fifth])) - settled) > _SETTLED * abs(size) + 4 * noise / np.sqrt(fifth):
        raise InputError(_short(record, record.t[first], held.size))
    part = (held - before) / size
    reached = int(np.argmax(part >= 0.9))
    earlier = part[reached - 1] if reached else 0.0
    late = (
        record.t[first + reached] - record.t[first] - record.period * (part[reached] - 0.9) / (part[reached] - earlier)
    )
    return float(late), 100 * max(0.0, float(part.max()) - 1), abs(size), held.size


def _short(record: Record, at: float, rows: int) -> str:
    return (
        f"record {record.name}: the step at {at:.3g} s dwells {rows * record.period:.3g} s, too short for it to "
        "settle; hold each step longer"
    )


def _scatter(values: np.ndarray) -> float:
    """Half of the 95 % interval of a mean by the values themselves; 0 where they are too few."""
    if values.size < 3:
        return 0.0
    return float(stdtrit(values.size - 1, 0.975) * np.std(values, ddof=1) / np.sqrt(values.size))
