"""Held-out errors before and after a change of the model, signal by signal, over the noise floor."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.fit.initial_states import FIRST_ROWS
from ...identify.fit.predict import Prediction
from ...identify.found.errors import Rms
from ...report import Curve, Figure, Known, Mark, Panel, Table
from ...report.table import Cell

GIVEN, BEFORE, BETWEEN, AFTER = "#8c959f", "#d55e00", "#cc79a7", "#0072b2"  # what is given is grey, in every report
_FEW_TIMES = 3.0  # a larger span of errors is drawn on a log axis

SCORED = {
    False: "Held-out records, windows of 0.5 s with refitted initial states; inputs: as recorded.",
    True: f"Held-out records, one free run each from the state that fits the first {FIRST_ROWS} rows, or from rest if "
    "the jack rests in them; inputs: as recorded.",
}
"""What the errors are of, by whether they are scored by a free run."""


def error_figure(rms: Rms, labels: Sequence[str]) -> Figure:
    """Held-out error of every signal over its noise; `labels` of the model, or of that before and that after.

    An error that nobody knows, since a window could not be simulated, is left out.
    """
    names = [label for label, row in rms.items() if row["floor"]]
    before, after = (np.array([_over_floor(rms[name], key) for name in names]) for key in ("before", "after"))
    places = np.arange(1.0, len(names) + 1)
    if len(labels) > 1:
        gap = np.full(len(names), np.nan)
        across, up = np.column_stack((places, places, gap)).ravel(), np.column_stack((before, after, gap)).ravel()
        curves = [
            Curve(labels[0], places, before, "markers", BEFORE),
            Curve(labels[1], places, after, "markers", AFTER),
            Curve("change", across, up, "dot", GIVEN),
        ]
    else:
        curves = [Curve(labels[0], places, before, "markers", AFTER)]
    known = [value for value in (*before, *after) if np.isfinite(value) and value > 0]
    low, high = min((0.9, *known)), max((1.5, *known))
    log = high > _FEW_TIMES
    ends = (0.9 * low, 1.15 * high) if log else (0.0, 1.15 * high)
    panel = Panel("error / noise [1]", curves, log_y=log, y_range=ends, marks=(Mark(1.0, "noise floor"),))
    return Figure("Held-out error over the noise", "signal", [panel], x_names=[name.split(" [")[0] for name in names])


def _over_floor(row: Mapping[str, float | None], key: str) -> float:
    """An error over its noise; NaN where there is none."""
    value, floor = row[key], row["floor"]
    return np.nan if value is None or not floor else value / floor


def error_table(rms: Rms, labels: Sequence[str], free_run: bool = False) -> Table:
    """Held-out error of every signal, in its unit: in windows, or of a free run."""
    changed = len(labels) > 1
    rows = []
    for label, row in rms.items():
        before, after, floor = row["before"], row["after"], row["floor"]
        over = [None if value is None or floor is None else value / floor for value in (before, after)]
        shown = [beside_floor(value, floor) for value in (before, after, floor)]
        rows.append([label, *shown, *over] if changed else [label, *shown[1:], over[1]])
    columns = ["signal", "RMS error", "noise floor", "error / floor"]
    if changed:
        errors, over = ([text.format(label) for label in labels] for text in ("RMS, {}", "{} / floor"))
        columns = ["signal", *errors, "noise floor", *over]
    return Table("Error by signal", columns, rows, note=SCORED[free_run])


def beside_floor(value: float | None, floor: float | None) -> Cell:
    """An error to the digits that the noise lets it have: to a hundredth of the noise."""
    return value if value is None or floor is None else Known(value, floor / 100)


def record_tables(models: Mapping[str, Sequence[Prediction]]) -> dict[str, dict[str, np.ndarray]]:
    """For every record what was measured and what each model, by label, predicts, in the units that people read."""
    tables = {}
    for together in zip(*models.values(), strict=True):
        record = together[0].record
        columns = {"t [s]": record.t, "command [1]": record.signals["command"]}
        for name in together[0].signals:
            signal = SIGNALS[name]
            columns[f"measured {signal.label}"] = from_si(record.signals[name], signal.unit, signal.si)
            for label, prediction in zip(models, together, strict=True):
                columns[f"{label} {signal.label}"] = from_si(prediction.signals[name], signal.unit, signal.si)
        tables[f"heldout-{record.name.replace('/', '-')}"] = columns
    return tables
