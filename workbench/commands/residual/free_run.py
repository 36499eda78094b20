"""One free run beside the mean of repeats: rows, table and figures for the report of a residual."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.data.noise_floor import NoiseFloor
from ...identify.fit.repeats import MOVING, STANDING, WHOLE, FreeRunComparison, against_mean, repeated
from ...plant import Plant
from ...records import Record
from ...report import Curve, Figure, Panel, Section, Table

PHASES = (WHOLE, MOVING, STANDING)


def free_runs(plant: Plant, records: Sequence[Record], floor: NoiseFloor) -> list[FreeRunComparison]:
    """Every signal of every group of repeats among the records, beside one free run."""
    return [comparison for group in repeated(records) for comparison in against_mean(plant, group, floor)]


def free_run_rows(comparisons: Sequence[FreeRunComparison]) -> list[dict[str, Any]]:
    """One row a signal of a group, in the units that people read; null where a phase or a spread does not exist."""
    return [
        {
            "records": list(comparison.records),
            "signal": comparison.name,
            "unit": SIGNALS[comparison.name].unit,
            **{phase: _shown(comparison, comparison.errors.get(phase)) for phase in PHASES},
            "repeatability": {phase: _shown(comparison, comparison.repeatability.get(phase)) for phase in PHASES},
        }
        for comparison in comparisons
    ]


def free_run_section(comparisons: Sequence[FreeRunComparison]) -> Section:
    """The table of errors beside the repeatability, and each mean with its free run."""
    rows = []
    for row in free_run_rows(comparisons):
        repeatability = row["repeatability"]
        numbers = [number for phase in PHASES for number in (row[phase], repeatability[phase])]
        rows.append([", ".join(row["records"]), row["signal"], row["unit"], *numbers])
    table = Table(
        "RMS distance of one free run to the mean of the repeats",
        ["repeats", "signal", "unit", *(text for phase in PHASES for text in (phase, "repeats differ by"))],
        rows,
        note="One run through the whole record, driven by the recorded command alone, from the state that fits its "
        "first 0.5 s. Moving: the measured position's speed over 0.05 s is above a tenth of the fastest; standing is "
        "the rest, on the end stops. Clipped samples are not compared. Repeats differ by: the standard deviation of a "
        "repeat, RMS over the same samples.",
    )
    return Section("Free run against the mean of repeats", [table, *map(_figure, comparisons)])


def _shown(comparison: FreeRunComparison, value: float | None) -> float | None:
    signal = SIGNALS[comparison.name]
    return None if value is None else float(from_si(value, signal.unit, signal.si))


def _figure(comparison: FreeRunComparison) -> Figure:
    signal = SIGNALS[comparison.name]
    mean, model = (from_si(values, signal.unit, signal.si) for values in (comparison.mean, comparison.model))
    left = np.where(comparison.compared, mean - model, np.nan)
    return Figure(
        f"{comparison.name}: mean of {len(comparison.records)} repeats and one free run",
        "time [s]",
        [
            Panel(signal.label, [Curve("mean of repeats", comparison.t, mean), Curve("free run", comparison.t, model)]),
            Panel(f"mean - free run [{signal.unit}]", [Curve("difference", comparison.t, left)]),
        ],
    )
