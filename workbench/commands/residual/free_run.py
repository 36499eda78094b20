"""One free run beside a record, or the mean of its repeats: rows, table and figures for the report of a residual."""

from collections.abc import Mapping, Sequence
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


def free_runs(plants: Mapping[str, Plant], records: Sequence[Record], floor: NoiseFloor) -> list[FreeRunComparison]:
    """Every signal of every group of repeats among the records, and of those without any, beside one free run.

    `plants` by record: what is of different plants is no repeat.
    """
    groups = [group for same in _by_plant(plants, records) for group in repeated(same)]
    in_groups = {record.name for group in groups for record in group}
    groups += [(record,) for record in records if record.name not in in_groups]
    return [comparison for group in groups for comparison in against_mean(plants[group[0].name], group, floor)]


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


def free_run_sentence(comparisons: Sequence[FreeRunComparison]) -> str:
    """The error of every free run, signal by signal."""
    by_records: dict[str, list[str]] = {}
    for row in free_run_rows(comparisons):
        error = "unknown, the run fails" if row[WHOLE] is None else f"{row[WHOLE]:.3g} {row['unit']}"
        by_records.setdefault(_of(row["records"]), []).append(f"{row['signal']} {error}")
    each = "; ".join(f"{', '.join(errors)} in {of}" for of, errors in by_records.items())
    return f"One free run leaves, RMS: {each}."


def free_run_section(comparisons: Sequence[FreeRunComparison]) -> Section:
    """The table of errors beside the repeatability, and each mean with its free run."""
    rows = []
    for row in free_run_rows(comparisons):
        repeatability = row["repeatability"]
        numbers = [number for phase in PHASES for number in (row[phase], repeatability[phase])]
        rows.append([", ".join(row["records"]), row["signal"], row["unit"], *numbers])
    table = Table(
        "RMS distance of one free run to the record, or to the mean of its repeats",
        ["record", "signal", "unit", *(text for phase in PHASES for text in (phase, "repeats differ by"))],
        rows,
        note="One run through the whole record, driven by the recorded command alone, from the state that fits its "
        "first 0.5 s. Moving: the measured position's speed over 0.05 s is above a tenth of the fastest; standing is "
        "the rest. Clipped samples are not compared. Repeats differ by: the standard deviation of a repeat, RMS over "
        "the same samples.",
    )
    return Section("Free run", [table, *map(_figure, comparisons)])


def _by_plant(plants: Mapping[str, Plant], records: Sequence[Record]) -> list[list[Record]]:
    same: dict[int, list[Record]] = {}
    for record in records:
        same.setdefault(id(plants[record.name]), []).append(record)
    return list(same.values())


def _of(records: Sequence[str]) -> str:
    return records[0] if len(records) == 1 else f"mean of {', '.join(records)}"


def _shown(comparison: FreeRunComparison, value: float | None) -> float | None:
    signal = SIGNALS[comparison.name]
    return None if value is None else float(from_si(value, signal.unit, signal.si))


def _figure(comparison: FreeRunComparison) -> Figure:
    signal = SIGNALS[comparison.name]
    mean, model = (from_si(values, signal.unit, signal.si) for values in (comparison.mean, comparison.model))
    left = np.where(comparison.compared, mean - model, np.nan)
    return Figure(
        f"{comparison.name}: {_of(comparison.records)} and one free run",
        "time [s]",
        [
            Panel(signal.label, [Curve("measured", comparison.t, mean), Curve("free run", comparison.t, model)]),
            Panel(f"measured - free run [{signal.unit}]", [Curve("difference", comparison.t, left)]),
        ],
    )
