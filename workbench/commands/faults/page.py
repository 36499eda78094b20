"""The report of a faults experiment: verdict, a table of faults, what is not seen, and loops without a fault."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.words import counted
from ...loop.fault_trial import BEYOND, MOMENTS, STOP, FaultTrials, counts, harmful
from ...report import Figure, Page, Section, Table
from ..common.fitted_plant import with_fit
from ..common.judged import played_words
from ..common.metric_table import MetricView
from ..common.time_figure import share_figure
from .fault_free import FAILED, tripped

_WORST = ("stop_speed", "peak_force", "beyond_percent")

_Row = Mapping[str, Any]


def faults_page(trials: FaultTrials, metrics: Mapping[str, Any]) -> Page:
    """One table of faults over all loops, one of what passed the goals, one of what was not detected."""
    rows = metrics["rows"]
    sections = [
        Section("Faults", [_faults(trials, rows), faults_figure(rows)]),
        Section("Beyond the goals", [_beyond(rows)]),
        *([Section("With a shut-off valve", [_shut(trials, metrics)])] if metrics["counts"]["helpless"] else []),
        *([Section("Not detected", [_unseen(rows)])] if metrics["counts"]["detected"] < len(rows) else []),
        Section("Without a fault", [_calm(metrics)]),
    ]
    page = Page(f"Faults on {trials.rig.name}", verdict(metrics), sections, {"seed": str(trials.conditions.seed)})
    return with_fit(page, trials.rig)


def verdict(metrics: Mapping[str, Any]) -> str:
    """How many faults did harm, how many of them a command could have prevented, and the false trips."""
    many = counts(metrics["rows"])
    words = f"{many['played']} faults: {many['harm']} meet the stop above {STOP:g} m/s or pass a limit by more than "
    words += f"{BEYOND:g} %"
    words += f", besides {many['helpless']} of a stuck valve, which no command stops" if many["helpless"] else ""
    words += _saving(metrics)
    words += f"; {counted(metrics['false_trips'], 'false trip')} on the rig itself"
    words += f" and on {counted(metrics['plants'], 'plant')} a loop" if metrics["trips"] else ""
    if metrics["left_out"]:
        words += f"; no drawn plants under {', '.join(metrics['left_out'])}"
    if failed := sum(each.get(FAILED, 0) for each in metrics["trips"].values()):
        words += f"; {counted(failed, 'drawn plant')} could not be simulated"
    return f"{words}."


def _saving(metrics: Mapping[str, Any]) -> str:
    """Which of the tried shut-off valves saves how many; nothing where there is nothing to save."""
    tried = [each for each in metrics["shut_off"] if each["of"]]
    if not tried:
        return ""
    left = ", ".join(f"{each['closing_ms']:g} ms leaves {each['harm']}" for each in tried)
    return f" (again with a shut-off valve in its lines: one that closes in {left})"


def _shut(trials: FaultTrials, metrics: Mapping[str, Any]) -> Table:
    """What a shut-off valve of each closing time leaves of the faults that no command stops."""
    own = trials.rig.shut_off
    has = f"declares one that closes in {1e3 * own.closing_time.value:g} ms" if own else "declares none ([shut_off])"
    note = f"The faults of a stuck valve that do harm, again, with both lines closed from the trip on; this rig {has}."
    heads = {"closing_ms": "closing time [ms]", "of": "faults", "harm": "still do harm"}
    return MetricView().table("", metrics["shut_off"], (*heads, *_WORST), note, heads=heads)


def _faults(trials: FaultTrials, rows: Sequence[_Row]) -> Table:
    """A line a fault: over all loops and moments."""
    lines = []
    for name in dict.fromkeys(row["fault"] for row in rows):
        mine = [row for row in rows if row["fault"] == name]
        times = [row["detected_ms"] for row in mine if row["detected_ms"] is not None]
        median, worst = (float(np.median(times)), max(times)) if times else (None, None)
        counts = {"fault": name, "played": len(mine), "detected": len(times)}
        most = {key: max(row[key] for row in mine) for key in _WORST}
        lines.append(counts | {"detected_median_ms": median, "detected_worst_ms": worst} | most)
    note = f"Worst of all loops and of {len(MOMENTS)} moments: {', '.join(MOMENTS)}. Force of load cell or end stop. "
    keys = ("fault", "played", "detected", "detected_median_ms", "detected_worst_ms", *_WORST)
    return MetricView().table("All loops", lines, keys, note + played_words(trials.conditions, trials.rig))


def _beyond(rows: Sequence[_Row]) -> Table:
    keys = ("fault", "controller", "moment", "detected_ms", *_WORST, "tripped")
    note = f"Above {STOP:g} m/s at the end stop, or more than {BEYOND:g} % beyond a limit of stroke, speed or force."
    return MetricView().table("", [row for row in rows if harmful(row)], keys, note)


def _unseen(rows: Sequence[_Row]) -> Table:
    """Faults that some loops did not detect, and what they did there."""
    lines = []
    for name in dict.fromkeys(row["fault"] for row in rows):
        unseen = [row for row in rows if row["fault"] == name and row["detected_ms"] is None]
        if unseen:
            loops = ", ".join(dict.fromkeys(row["controller"] for row in unseen))
            lines.append([name, len(unseen), max(row["beyond_percent"] for row in unseen), loops])
    note = "The guard did not trip from the fault's beginning to the end of the time that is watched."
    return Table("", ["fault", "not detected", "beyond a limit [%]", "loops"], lines, note)


def _calm(metrics: Mapping[str, Any]) -> Table:
    lines = [
        [name, metrics["plants"], tripped(trips), ", ".join(f"{count} {what}" for what, count in trips.items())]
        for name, trips in metrics["trips"].items()
    ]
    note = "A step of each loop on drawn plants without a fault."
    if metrics["left_out"]:
        note += f" Laws that do not run in lanes are left out: {', '.join(metrics['left_out'])}."
    return Table("", ["controller", "plants", "false trips", "by"], lines, note)


def faults_figure(rows: Sequence[_Row]) -> Figure:
    """The share of the faults that is detected, over time, by moment."""
    times = {each: np.array([row["detected_ms"] for row in rows if row["moment"] == each], float) for each in MOMENTS}
    return share_figure("Share of the faults that are detected", times, "time [ms]", "detected [%]")
