"""The noise floor: how far a perfect model, driven by the recorded command, would still be from each signal."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.signal import lfilter

from ...base.errors import InputError
from ...base.signals import MEASURED
from ...records import Campaign, Record
from .static import check_static
from .white_part import white_part

STATIC = "static record"
ESTIMATED = "estimated from the records"
QUANTISATION = "quantisation"
REPEATS = "differences between repeats"

PIECE = 2.0  # s, about; drift is what a parabola follows within it
MAINS = (50.0, 60.0, 100.0, 120.0)  # Hz
MAINS_SPAN = 0.5  # s; a shorter run cannot tell a mains line from its neighbours
FEWEST_ROWS = 20
RINGING_ROWS = 500  # fewer do not resolve a ringing
RINGING_SHARE = 0.05  # of the variance; less moves sigma by less than 2.5 %
RINGING_CHANCE = 60.0  # over the rows: what the best of many modes explains of mere noise, with some room
REPEATED = 0.5  # s: pieces in which repeats are compared
CALM = 4.0  # times the median variance of the pieces: beyond it a repeat came earlier or later, which is no noise
FED_BACK = ("position", "force")  # their noise is in the command, by the loop, and would pass for an answer to it


@dataclass(frozen=True)
class NoiseFloor:
    """Per measured signal: sigma (SI), kappa (variance of a mean over that of white noise, >= 1), and whence both."""

    sigma: Mapping[str, float]
    kappa: Mapping[str, float]
    source: Mapping[str, str]


@dataclass(frozen=True)
class RepeatedRun:
    """Errors [n] of one signal at even times, where they count [n] bool, period in s, numbers fitted to them."""

    error: np.ndarray
    valid: np.ndarray
    period: float
    fitted: int = 0


def noise_floor(campaign: Campaign) -> NoiseFloor:
    """The noise floor of every measured signal that some record carries.

    From the static records: sigma is what is left after drift and the rig's own answer to the recorded command are
    taken off. Drift is a parabola over pieces of about 2 s: it takes nothing faster than about 1 Hz, and what is
    slower hides in the free initial states of a 0.5 s window anyway. The rig's answer is one damped mode driven by the
    command: in closed loop a jack rings at its hydraulic frequency on the last bits of the command, which is no noise,
    since a model predicts it (counted as noise it made pressures up to 65 % noisier). Mains hum stays in sigma.

    Where a command was recorded more than once, what repeats differ by (see `_repeated`) counts if it is more: valves
    that stand still at rest are noisy in motion, and no model is closer than one repeat to the next.

    Without either: from third differences in train and heldout, which see the white part only; kappa is 1.
    sigma is never below the smallest step seen in any record / sqrt(12). Raises InputError for a signal that never
    changes, as no floor can be given, and for a static record that moves.
    """
    check_static(campaign)
    records = campaign.records
    rest = [runs for record in campaign.static for runs in _at_rest(record)]
    again = _repeated((*campaign.train, *campaign.select, *campaign.heldout))
    sigma, kappa, source = {}, {}, {}
    for name in MEASURED:
        carriers = [record for record in records if name in record.signals]
        if not carriers:
            continue
        runs = [piece[name] for piece in rest if name in piece]
        floor = (*sigma_and_kappa(runs), STATIC) if runs else (0.0, 1.0, STATIC)
        if name in again:
            floor = max(floor, (*sigma_and_kappa(again[name]), REPEATS))
        elif not runs:
            floor = (white_part(name, carriers), 1.0, ESTIMATED)
        least = _resolution(campaign, name, carriers) / np.sqrt(12.0)
        sigma[name], kappa[name], source[name] = floor if floor[0] > least else (least, 1.0, QUANTISATION)
    return NoiseFloor(sigma, kappa, source)


def sigma_and_kappa(runs: Sequence[RepeatedRun]) -> tuple[float, float]:
    """sigma and kappa = 1 + 2 sum rho_k of one signal's errors, pooled over runs.

    The sum ends at the first lag beyond six times itself (Sokal's window: Madras and Sokal 1988, J. Stat. Phys. 50,
    appendix C). Mains lines count in sigma, not in the sum: over whole periods they do not move a mean.
    """
    squares = sum(float(np.sum(run.error[run.valid] ** 2)) for run in runs)
    variance = squares / sum(max(1, int(run.valid.sum()) - run.fitted) for run in runs)
    if variance == 0.0:
        return 0.0, 1.0
    kappa = 1.0
    for lag, covariance in enumerate(_covariances(runs), 1):
        kappa += 2.0 * float(covariance) / variance
        if lag >= 6.0 * kappa:
            break
    return float(np.sqrt(variance)), max(1.0, kappa)


def _repeated(records: Sequence[Record]) -> dict[str, list[RepeatedRun]]:
    """Differences between records of one command, over root 2, in pieces of 0.5 s less a parabola; calm pieces only."""
    differences: dict[str, list[RepeatedRun]] = {}
    for place, first in enumerate(records):
        alike = (other for other in records[:place] if _shares_a_signal(first, other) and same_command(first, other))
        second = next(alike, None)
        for name in first.names if second is not None else ():
            if second is not None and name in second.signals and name in MEASURED:
                differences.setdefault(name, []).extend(_differences(first, second, name))
    return {name: _calm(runs) for name, runs in differences.items() if runs}


def same_command(first: Record, second: Record) -> bool:
    """Whether two records hold the same moving command, row by row as far as both last: repeats of one experiment."""
    a, b = (record.signals.get("command", np.zeros(0)) for record in (first, second))
    rows = min(a.size, b.size)
    return rows > 0 and np.ptp(a) > 0 and np.array_equal(a[:rows], b[:rows])


def _shares_a_signal(first: Record, second: Record) -> bool:
    return any(name in MEASURED and name in second.signals for name in first.signals)


def _differences(first: Record, second: Record, name: str) -> list[RepeatedRun]:
    rows = min(first.t.size, second.t.size)
    error = (first.signals[name][:rows] - second.signals[name][:rows]) / np.sqrt(2.0)
    valid = first.valid[name][:rows] & second.valid[name][:rows]
    pieces = np.array_split(np.arange(rows), max(1, round(rows * first.period / REPEATED)))
    drifts = {size: _orthonormal(_drift(size)) for size in {piece.size for piece in pieces}}
    return [
        RepeatedRun(_without(drifts[piece.size], error[piece]), valid[piece], first.period, drifts[piece.size].shape[1])
        for piece in pieces
        if valid[piece].all() and piece.size >= FEWEST_ROWS
    ]


def _calm(runs: list[RepeatedRun]) -> list[RepeatedRun]:
    squares = np.array([np.mean(run.error**2) for run in runs])
    return [run for run, square in zip(runs, squares, strict=True) if square <= CALM * np.median(squares)]


def _covariances(runs: Sequence[RepeatedRun]) -> np.ndarray:
    """Autocovariance at lags 1, 2 ... over pairs of valid samples, mains lines taken off."""
    most = max(2, max(run.error.size for run in runs) // 4)
    products, pairs = np.zeros(most), np.zeros(most)
    for run in runs:
        hum = _orthonormal(_mains(run.error.size, run.period))
        products += _correlate(np.where(run.valid, _without(hum, run.error), 0.0), most)
        pairs += _correlate(run.valid.astype(float), most)
    return products[1:] / np.maximum(pairs[1:], 1.0)


def _correlate(values: np.ndarray, lags: int) -> np.ndarray:
    """Sums of values[i] values[i + k], k = 0 .. lags - 1."""
    length = values.size + lags
    return np.fft.irfft(np.abs(np.fft.rfft(values, length)) ** 2, length)[:lags]


def _at_rest(record: Record) -> list[dict[str, RepeatedRun]]:
    """The errors in a static record, piece by piece: its signals without drift and without the rig's own motion."""
    period, mode, pieces = record.period, None, []
    command = record.signals.get("command", np.zeros(record.t.size))
    for rows in np.array_split(np.arange(record.t.size), max(1, round(record.t.size * period / PIECE))):
        drift = _orthonormal(_drift(rows.size))
        runs = {
            name: RepeatedRun(
                _without(drift, values[rows] - values[rows[0]]), record.valid[name][rows], period, drift.shape[1]
            )
            for name, values in record.signals.items()
            if name in MEASURED and record.valid[name][rows].sum() >= FEWEST_ROWS
        }
        moving = {name: run for name, run in runs.items() if name not in FED_BACK and run.error.any()}
        if moving and rows.size >= RINGING_ROWS and np.ptp(command[rows]) > 0.0:
            mode = mode or _ringing_mode(command[rows], moving.values(), period)
            runs |= {name: _without_ringing(command[rows], run, mode) for name, run in moving.items()}
        pieces.append(runs)
    return pieces


def _ringing_mode(command: np.ndarray, runs: Iterable[RepeatedRun], period: float) -> tuple[float, float]:
    """Frequency in Hz and damping of the one mode that explains most of all signals: a coarse grid, then a fine one."""
    errors = np.column_stack([run.error / np.linalg.norm(run.error) for run in runs])
    others = _drift_and_mains(command.size, period)

    def best(frequencies: np.ndarray, dampings: np.ndarray) -> tuple[float, float]:
        modes = [(float(frequency), float(damping)) for frequency, damping in product(frequencies, dampings)]
        shares = [np.sum((_answers(command, period, mode, others).T @ errors) ** 2) for mode in modes]
        return modes[int(np.argmax(shares))]

    frequency, damping = best(np.geomspace(5.0, 0.15 / period, 120), np.array([0.015, 0.06]))
    return best(frequency * np.linspace(0.98, 1.02, 9), damping * np.array([0.5, 0.7, 1.0, 1.4, 2.0]))


def _without_ringing(command: np.ndarray, run: RepeatedRun, mode: tuple[float, float]) -> RepeatedRun:
    """The run less the mode's answer to the command, where that explains more than chance would."""
    basis = _answers(command, run.period, mode, _drift_and_mains(command.size, run.period))
    answer = basis @ (basis.T @ run.error)
    if answer @ answer <= max(RINGING_SHARE, RINGING_CHANCE / command.size) * (run.error @ run.error):
        return run
    return replace(run, error=run.error - answer, fitted=run.fitted + basis.shape[1] + len(mode))


def _answers(command: np.ndarray, period: float, mode: tuple[float, float], others: np.ndarray) -> np.ndarray:
    """Orthonormal [n, 4]: a mode's answers to the command (one sample later at least) and from any initial state.

    Drift and mains lines, `others`, are kept out: hum that a loop carries into the command is no answer to it.
    """
    frequency, damping = mode
    pole = np.exp(2.0 * np.pi * frequency * period * complex(-damping, np.sqrt(1.0 - damping**2)))
    driven = np.asarray(lfilter([0.0, 1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], command))
    free = pole ** np.arange(command.size)
    later = np.concatenate(([0.0], driven[:-1]))
    return _orthonormal(_without(others, np.column_stack((driven, later, free.real, free.imag))))


def _drift_and_mains(rows: int, period: float) -> np.ndarray:
    return _orthonormal(np.hstack((_drift(rows), _mains(rows, period))))


def _drift(rows: int) -> np.ndarray:
    return np.vander(np.linspace(-1.0, 1.0, rows), 3)


def _mains(rows: int, period: float) -> np.ndarray:
    """cos and sin [n, 8] of the mains lines, those below the Nyquist frequency; [n, 0] where the run is too short."""
    lines = [f for f in MAINS if rows * period >= MAINS_SPAN and f * period < 0.5]
    phase = 2.0 * np.pi * period * np.outer(np.arange(rows), lines)
    return np.hstack((np.cos(phase), np.sin(phase)))


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    return np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny))[0]


def _without(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return values - basis @ (basis.T @ values)


def _resolution(campaign: Campaign, name: str, records: Sequence[Record]) -> float:
    """The smallest step between two values of a signal. Raises InputError where there is but one value."""
    values = np.unique(np.concatenate([record.signals[name][record.valid[name]] for record in records]))
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * np.ptp(values)] if steps.size else steps  # less is the rounding of a conversion
    if steps.size == 0:
        raise InputError(f"{campaign.path}: {name}: one value in every record, so no noise floor; remove the column")
    return float(steps.min())
