"""Which controller to take: a table of all over the envelope, a sentence, and Ms against settling."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.units import from_si
from ...loop.envelope_row import EnvelopeRow, choice, envelope_rigs, has_envelope, judged_step, shortfall
from ...loop.scenarios import POSITIONS, Limits
from ...report import Curve, Figure, Mark, Panel, Section, Table
from ..common.bench_experiment import BenchLoop
from .nichols import nichols_cloud

Metrics = Mapping[str, Any]
Clouds = Mapping[str, Mapping[str, Any]]  # of a stage, by controller


def verdict_sections(loop: BenchLoop, clouds: Clouds, metrics: Metrics) -> list[Section]:
    """Table and pictures, where controllers of this loop were judged over the envelope."""
    rows = _rows(loop, metrics)
    if not rows:
        return []
    title = f"{loop.signal.name.capitalize()} loops: over stroke and rigs"
    charts = [nichols_cloud(row["controller"], clouds[row["controller"]]) for row in sorted(rows, key=shortfall)]
    return [
        Section(title, [_table(loop, rows, metrics), *_without(loop, rows), *_missed(rows), *_scatter(loop, rows)]),
        Section(f"{title}, Nichols charts", charts),
    ]


def verdict_picture(loop: BenchLoop, metrics: Metrics) -> Figure | None:
    """Ms against settling, where more than one controller has both."""
    rows = _rows(loop, metrics)
    (figure,) = (_scatter(loop, rows) if rows else []) or [None]
    return figure if figure and len(figure.panels[0].curves) > 1 else None


def verdict_sentence(loop: BenchLoop, metrics: Metrics) -> str:
    """Which controller to take, where controllers of this loop were judged over the envelope."""
    rows = _rows(loop, metrics)
    return choice(rows, judged_step(loop.scenarios).name) if rows else ""


def _rows(loop: BenchLoop, metrics: Metrics) -> list[EnvelopeRow]:
    names = {spec.name for spec in loop.controllers} if has_envelope(loop.scenarios) else set()
    return [row for row in metrics["envelope"] if row["controller"] in names]


def _missed(rows: Sequence[EnvelopeRow]) -> list[Table]:
    """Missed goals and their worst plants; a number that an unstable loop does not have is not listed."""
    lines = [
        [row["controller"], goal["name"], goal["value"], goal["limit"], goal["where"]]
        for row in rows
        for goal in row["goals"]
        if goal["miss"]
    ]
    return [Table("Missed goals", ["controller", "goal", "value", "limit", "worst on"], lines)] if lines else []


def _table(loop: BenchLoop, rows: Sequence[EnvelopeRow], metrics: Metrics) -> Table:
    lines = [_line(loop, row, metrics["timing"][row["controller"]]) for row in rows]
    names = list(lines[0])
    places = ", ".join(f"{100 * share:g}" for share in POSITIONS)
    return Table(
        f"{judged_step(loop.scenarios).name} and loads over stroke and rigs",
        names,
        [list(line.values()) for line in lines],
        note=f"On {', '.join(envelope_rigs(loop.rigs))} at {places} % of the stroke limit, towards the middle, all "
        "controllers on the same plants. Steps and loads under the bench's conditions. Values are the worst; nominal "
        "is the first rig. Settling on a specimen is a column of its own; recovery runs from a load's coming until the "
        "jack is back within the sensor's band. Ms at null and moving; its worst includes the bad corner of all "
        "declared bounds. A dash: the loop is unstable, never settles or never makes up for a load.",
        best=dict.fromkeys((name for name in names if name not in ("controller", "slowest on")), "min"),
    )


def _line(loop: BenchLoop, row: EnvelopeRow, timing: Mapping[str, float]) -> dict[str, Any]:
    unit = loop.signal.unit
    noise = next(goal["value"] for goal in row["goals"] if goal["metric"] == "command_rms")
    rigs = envelope_rigs(loop.rigs)
    nominal, stiffnesses = next(iter(rigs.values())), {rig.specimen_stiffness for rig in rigs.values()}
    line = {
        "controller": row["controller"],
        "settling nominal [s]": row["settling_nominal_s"],
        "settling [s]": row["settling_worst_s"],
        "slowest on": row["where"],
        **{
            f"{each['scenario'].removeprefix(f'{loop.signal.name}-')} [s]": each["settling_worst_s"]
            for each in row["steps"]
            if each["scenario"] != judged_step(loop.scenarios).name
        },
        **(
            {
                "on other specimens [s]" if nominal.specimen_stiffness else "on a specimen [s]": row[
                    "settling_specimen_s"
                ]
            }
            if len(stiffnesses) > 1
            else {}
        ),
        "overshoot [%]": row["overshoot_worst_percent"],
        "Ms nominal": row["ms_nominal"],
        "Ms": row["ms_worst"],
    }
    for load in row["loads"]:
        name, peak = load["scenario"].removeprefix(f"{loop.signal.name}-"), load["peak_worst"]
        line[f"{name}: recovery [s]"] = load["recovery_worst_s"]
        line[f"{name}: peak [{unit}]"] = None if peak is None else float(from_si(peak, unit, loop.signal.si))
    return line | {
        "command noise [0.1 %]": None if noise is None else noise * 1e3,
        "compute 99 % [us]": timing["solve_p99_us"],
        "goals missed": len([goal for goal in row["goals"] if goal["miss"]]),
    }


def _without(loop: BenchLoop, rows: Sequence[EnvelopeRow]) -> list[str]:
    judged = {row["controller"] for row in rows}
    names = [spec.name for spec in loop.controllers if spec.name not in judged]
    return [f"Not judged over the stroke, for they have no linear view: {', '.join(names)}."] if names else []


def _scatter(loop: BenchLoop, rows: Sequence[EnvelopeRow]) -> list[Figure]:
    """Ms against settling, both at worst."""
    keys = ("settling_worst_s", "ms_worst")
    points = {row["controller"]: [row[key] for key in keys] for row in rows}
    lacking = [name for name, point in points.items() if None in point]
    marks = [
        Curve(name, np.array([x]), np.array([y]), "markers") for name, (x, y) in points.items() if name not in lacking
    ]
    note = f"Unstable or unsettled on some plant: {', '.join(lacking)}." if lacking else ""
    panel = Panel("Ms, worst [1]", marks, marks=(Mark(Limits().ms, "limit"),))
    label = f"settling of {judged_step(loop.scenarios).name}, worst [s]"
    return [Figure("Robust and quick", label, [panel], log_x=True, note=note, height=420)] if marks else []
