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
    return [one for group in repeated(records) for one in against_mean(plant, group, floor)]


def free_run_rows(found: Sequence[FreeRunComparison]) -> list[dict[str, Any]]:
    """One row a signal of a group, in the units that people read; null where a phase or a spread does not exist."""
    return [
        {
            "records": list(one.records),
            "signal": one.name,
            "unit": SIGNALS[one.name].unit,
            **{phase: _shown(one, one.errors.get(phase)) for phase in PHASES},
            "repeatability": {phase: _shown(one, one.repeatability.get(phase)) for phase in PHASES},
        }
        for one in found
    ]


def free_run_section(found: Sequence[FreeRunComparison]) -> Section:
    """The table of errors beside the repeatability, and each mean with its free run."""
    rows = []
    for row in free_run_rows(found):
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
    return Section("Free run against the mean of repeats", [table, *map(_figure, found)])


def _shown(one: FreeRunComparison, value: float | None) -> float | None:
    signal = SIGNALS[one.name]
    return None if value is None else float(from_si(value, signal.unit, signal.si))


def _figure(one: FreeRunComparison) -> Figure:
    signal = SIGNALS[one.name]
    mean, model = (from_si(values, signal.unit, signal.si) for values in (one.mean, one.model))
    left = np.where(one.compared, mean - model, np.nan)
    return Figure(
        f"{one.name}: mean of {len(one.records)} repeats and one free run",
        "time [s]",
        [
            Panel(signal.label, [Curve("mean of repeats", one.t, mean), Curve("free run", one.t, model)]),
            Panel(f"mean - free run [{signal.unit}]", [Curve("difference", one.t, left)]),
        ],
    )
