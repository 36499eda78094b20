"""Repeats of one command: their mean, how far they are apart, and how far one free run is from the mean.

One recording says as much about the day as about the rig: a repeat starts a little elsewhere and creeps a little
faster. The mean of repeats is what a free run, which nothing sets right on its way, is fairly held against.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.signals import MEASURED
from ...plant import Plant
from ...records import Record
from ..data.noise_floor import NoiseFloor, same_command
from .predict import predict_free
from .windows import further_inputs

WHOLE, MOVING, STANDING = "whole", "moving", "standing"
_SMOOTH = 0.05  # s, over which the speed is taken
_SLOW = 0.1  # of the fastest speed: below it the piston stands, on an end stop or at null


@dataclass(frozen=True, eq=False)
class FreeRunComparison:
    """One signal of a free run beside the mean of its repeats, SI.

    t, mean and model [n]; `errors` and `repeatability` are RMS over the phases whole, moving and standing: of the
    model's distance to the mean, and of a repeat's (its standard deviation). None where a phase has no sample or only
    one record carries the signal; without a position there is no phase but the whole.
    """

    name: str
    records: tuple[str, ...]
    t: np.ndarray
    mean: np.ndarray
    model: np.ndarray
    compared: np.ndarray
    errors: Mapping[str, float | None]
    repeatability: Mapping[str, float | None]


def repeated(records: Sequence[Record]) -> list[tuple[Record, ...]]:
    """Groups of two records or more of one command, cut to the shortest of each."""
    groups: list[list[Record]] = []
    for record in records:
        group = next((group for group in groups if same_command(group[0], record)), None)
        if group is None:
            groups.append([record])
        else:
            group.append(record)
    return [tuple(_shortest(group)) for group in groups if len(group) > 1]


def mean_of(group: Sequence[Record]) -> Record:
    """The mean of repeats of one length, signal by signal over those that carry it; valid where all of them are."""
    names = [name for name in MEASURED if any(name in record.signals for record in group)]
    carriers = {name: _carriers(group, name) for name in names}
    means = {name: np.mean([r.signals[name] for r in own], axis=0) for name, own in carriers.items()}
    valid = {name: np.all([r.valid[name] for r in own], axis=0) for name, own in carriers.items()}
    first = group[0]
    return Record(
        f"mean of {len(group)} repeats",
        first.t,
        {"command": first.signals["command"], **further_inputs(first), **means},
        valid,
        late=first.late,
    )


def against_mean(plant: Plant, group: Sequence[Record], floor: NoiseFloor) -> tuple[FreeRunComparison, ...]:
    """One free run of the plant beside the mean of repeats, signal by signal, phases apart.

    The run starts from the state that fits the first 0.5 s of the mean, and knows no more than the recorded command.
    """
    mean = mean_of(group)
    run = predict_free(plant, mean, floor)
    comparisons = []
    for name, model in run.signals.items():
        own = _carriers(group, name)
        compared = mean.valid[name]
        phases = _phases(own if _carriers(own, "position") else group)
        comparisons.append(
            FreeRunComparison(
                name,
                tuple(record.name for record in own),
                mean.t,
                mean.signals[name],
                model,
                compared,
                {phase: _rms((model - mean.signals[name])[compared & rows]) for phase, rows in phases.items()},
                {phase: _apart(own, name, compared & rows) for phase, rows in phases.items()},
            )
        )
    return tuple(comparisons)


def _carriers(group: Sequence[Record], name: str) -> tuple[Record, ...]:
    return tuple(record for record in group if name in record.signals)


def _shortest(group: Sequence[Record]) -> list[Record]:
    rows = min(record.t.size for record in group)
    return [
        Record(
            record.name,
            record.t[:rows],
            {name: values[:rows] for name, values in record.signals.items()},
            {name: mask[:rows] for name, mask in record.valid.items()},
            late=record.late,
        )
        for record in group
    ]


def _phases(group: Sequence[Record]) -> dict[str, np.ndarray]:
    """Rows [n] of each phase, told apart by the speed of the measured position."""
    mean = mean_of(group)
    every = np.ones(mean.t.size, bool)
    if "position" not in mean.signals:
        return {WHOLE: every}
    moving = _moving(mean.signals["position"], mean.period)
    return {WHOLE: every, MOVING: moving, STANDING: ~moving}


def _moving(position: np.ndarray, period: float) -> np.ndarray:
    """Whether the piston moves [n]: its speed over 0.05 s is more than a tenth of the fastest."""
    half = max(1, round(_SMOOTH / period / 2))
    padded = np.pad(position, 2 * half, mode="edge")
    sums = np.cumsum(np.concatenate(([0.0], padded)))
    smooth = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    speed = np.abs(smooth[2 * half :] - smooth[: -2 * half]) / (2 * half * period)
    return speed > _SLOW * speed.max()


def _apart(records: Sequence[Record], name: str, rows: np.ndarray) -> float | None:
    """How far a repeat is from the others: RMS over the rows of their standard deviation, `len(records) - 1` below."""
    if len(records) < 2:
        return None
    values = np.array([record.signals[name][rows] for record in records])
    return _rms(np.std(values, axis=0, ddof=1))


def _rms(values: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if values.size and np.isfinite(values).all() else None
