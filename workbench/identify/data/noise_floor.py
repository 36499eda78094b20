"""The noise floor: how far a perfect model, driven by the recorded command, would still be from each signal."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from ...base.errors import InputError
from ...base.signals import MEASURED
from ...records import Campaign, Record
from .rounding import HIDDEN, rounded_sigma
from .signal_noise import RepeatedRun, SignalNoise, mains, orthonormal, signal_noise, without
from .static import check_static
from .white_part import white_part

STATIC = "static record"
ESTIMATED = "estimated from the records"
QUANTISATION = "quantisation"
REPEATS = "differences between repeats"

PIECE = 2.0  # s, about; drift is what a parabola follows within it
FEWEST_ROWS = 20
RINGING_ROWS = 500  # fewer do not resolve a ringing
RINGING_SHARE = 0.05  # of the variance; less moves sigma by less than 2.5 %
RINGING_CHANCE = 60.0  # over the rows: what the best of many modes explains of mere noise, with some room
REPEATED = 0.5  # s: pieces in which repeats are compared
CALM = 4.0  # times the median variance of the pieces: beyond it a repeat came earlier or later, which is no noise
FED_BACK = ("position", "force")  # their noise is in the command, by the loop, and would pass for an answer to it


@dataclass(frozen=True)
class NoiseFloor:
    """Per measured signal: sigma (SI), kappa (variance of a mean over that of white noise, >= 1), and whence both.

    `colour` and `known_by` are those of SignalNoise; a signal that is not in them has white noise of exactly sigma.
    """

    sigma: Mapping[str, float]
    kappa: Mapping[str, float]
    source: Mapping[str, str]
    colour: Mapping[str, float] = field(default_factory=dict)
    known_by: Mapping[str, float] = field(default_factory=dict)

    def of(self, name: str) -> SignalNoise:
        """The noise of a signal."""
        return SignalNoise(
            self.sigma[name], self.kappa[name], self.colour.get(name, 1.0), self.known_by.get(name, np.inf)
        )

    def with_noise(self, name: str, noise: SignalNoise) -> "NoiseFloor":
        """The floor with another noise of a signal."""
        return replace(self, **{part: {**getattr(self, part), name: value} for part, value in noise._asdict().items()})

    def deviation(self, samples: Mapping[str, float]) -> float:
        """Standard deviation of the chi2 that a perfect model leaves in so many samples of each signal.

        A mean square of n samples scatters by 2 colour/n of itself, squared. sigma^2 is such a mean too, of another
        record, which all samples of a signal share: however many there are, chi2 is no better known than sigma^2.
        """
        scatter = {
            name: 2.0 * (self.colour.get(name, 1.0) / n + 1.0 / self.known_by.get(name, np.inf))
            for name, n in samples.items()
            if n
        }
        squares = sum(samples[name] ** 2 * square for name, square in scatter.items())
        return float(np.sqrt(squares)) / sum(samples.values())


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
    Where the smallest step seen in any record is larger than what is seen at rest, sigma is that of readings in motion
    (see rounding.py), step / sqrt(12) at least. Raises InputError for a signal that never
    changes, as no floor can be given, and for a static record that moves.
    """
    check_static(campaign)
    records = campaign.records
    rest = [runs for record in campaign.static for runs in _at_rest(record)]
    again = _repeated((*campaign.train, *campaign.select, *campaign.heldout))
    noises: dict[str, tuple[SignalNoise, str]] = {}
    for name in MEASURED:
        carriers = [record for record in records if name in record.signals]
        if not carriers:
            continue
        runs = [piece[name] for piece in rest if name in piece]
        floor = signal_noise(runs) if runs else SignalNoise(0.0, 1.0, 1.0, np.inf), STATIC
        if name in again:
            floor = max(floor, (signal_noise(again[name]), REPEATS))
        elif not runs:
            floor = white_part(name, carriers), ESTIMATED
        step = _resolution(campaign, name, carriers)
        if floor[0].sigma < HIDDEN * step:
            least = rounded_sigma((record.signals[name] for record in campaign.static if name in record.signals), step)
            floor = max(floor, (SignalNoise(least, 1.0, 1.0, np.inf), QUANTISATION))
        noises[name] = floor
    sigma, kappa, colour, known_by = (
        {name: noise[part] for name, (noise, _) in noises.items()} for part in range(len(SignalNoise._fields))
    )
    return NoiseFloor(sigma, kappa, {name: source for name, (_, source) in noises.items()}, colour, known_by)


def _repeated(records: Sequence[Record]) -> dict[str, list[RepeatedRun]]:
    """Differences between records of one command, over root 2, in pieces of 0.5 s less a parabola; calm pieces only."""
    differences: dict[str, list[RepeatedRun]] = {}
    for place, first in enumerate(records):
        alike = (other for other in records[:place] if _measured_again(first, other) and same_command(first, other))
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


def _measured_again(first: Record, second: Record) -> bool:
    """Whether both have a measured signal, with other readings: one record may stand in two roles."""
    shared = (name for name in first.signals if name in MEASURED and name in second.signals)
    return any(not np.array_equal(first.signals[name], second.signals[name]) for name in shared)


def _differences(first: Record, second: Record, name: str) -> list[RepeatedRun]:
    rows = min(first.t.size, second.t.size)
    error = (first.signals[name][:rows] - second.signals[name][:rows]) / np.sqrt(2.0)
    valid = first.valid[name][:rows] & second.valid[name][:rows]
    pieces = np.array_split(np.arange(rows), max(1, round(rows * first.period / REPEATED)))
    drifts = {size: orthonormal(_drift(size)) for size in {piece.size for piece in pieces}}
    return [
        RepeatedRun(without(drifts[piece.size], error[piece]), valid[piece], first.period, drifts[piece.size].shape[1])
        for piece in pieces
        if valid[piece].all() and piece.size >= FEWEST_ROWS
    ]


def _calm(runs: list[RepeatedRun]) -> list[RepeatedRun]:
    squares = np.array([np.mean(run.error**2) for run in runs])
    return [run for run, square in zip(runs, squares, strict=True) if square <= CALM * np.median(squares)]


def _at_rest(record: Record) -> list[dict[str, RepeatedRun]]:
    """The errors in a static record, piece by piece: its signals without drift and without the rig's own motion."""
    period, mode, pieces = record.period, None, []
    command = record.signals.get("command", np.zeros(record.t.size))
    for rows in np.array_split(np.arange(record.t.size), max(1, round(record.t.size * period / PIECE))):
        drift = orthonormal(_drift(rows.size))
        runs = {
            name: RepeatedRun(
                without(drift, values[rows] - values[rows[0]]), record.valid[name][rows], period, drift.shape[1]
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
    from scipy.signal import lfilter  # here, as it takes a third of a second

    frequency, damping = mode
    pole = np.exp(2.0 * np.pi * frequency * period * complex(-damping, np.sqrt(1.0 - damping**2)))
    driven = np.asarray(lfilter([0.0, 1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], command))
    free = pole ** np.arange(command.size)
    later = np.concatenate(([0.0], driven[:-1]))
    return orthonormal(without(others, np.column_stack((driven, later, free.real, free.imag))))


def _drift_and_mains(rows: int, period: float) -> np.ndarray:
    return orthonormal(np.hstack((_drift(rows), mains(rows, period))))


def _drift(rows: int) -> np.ndarray:
    return np.vander(np.linspace(-1.0, 1.0, rows), 3)


def _resolution(campaign: Campaign, name: str, records: Sequence[Record]) -> float:
    """The smallest step between two values of a signal. Raises InputError where there is but one value."""
    values = np.unique(np.concatenate([record.signals[name][record.valid[name]] for record in records]))
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * np.ptp(values)] if steps.size else steps  # less is the rounding of a conversion
    if steps.size == 0:
        raise InputError(f"{campaign.path}: {name}: one value in every record, so no noise floor; remove the column")
    return float(steps.min())
