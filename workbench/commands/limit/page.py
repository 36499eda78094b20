"""The report of the limits: a line a scenario and place, and the motions over time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...base.words import counted, spanned
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...rigs.rig import Rig
from ..common.metric_table import MetricView

_STEPS = (
    *("scenario", "rig", "x_m", "stiffness_n_per_m", "limit_s", "mesh_difference_s", "lowest_pressure_bar"),
    *("peak_command", "overshoot_percent", "played_off_percent", "reason"),
)
_MOVING = (
    *("scenario", "x_m", "limit_error", "mesh_difference_error", "largest_error", "lowest_pressure_bar"),
    *("peak_command", "reason"),
)
_SHOWN = ("position", "force", "command", "pa", "pb")

Courses = Mapping[str, Mapping[str, np.ndarray]]


def limit_page(rig: Rig, metrics: Mapping[str, Any], courses: Courses) -> Page:
    """One table, and a figure for every scenario."""
    rows = metrics["rows"]
    steps, moving = ([row for row in rows if row["moves"] is moves] for moves in (False, True))
    tables = [_table(metrics, steps)] if steps else []
    sections = [Section("Limits", [*tables, *_tracking_tables(metrics, moving)])]
    sections += [Section(scenario, [_figure(scenario, courses)]) for scenario in _scenarios(courses)]
    return Page(f"The limit of {rig.name}", _verdict(rows), sections)


def limit_picture(courses: Courses) -> Figure:
    """The motions of the first scenario; an empty figure where nothing was found."""
    return _figure(next(iter(_scenarios(courses)), ""), courses)


def _verdict(rows: Sequence[Mapping[str, Any]]) -> str:
    settled = [f"{name} in {spanned(times)} s" for name, times in _by_scenario(rows, "limit_s").items()]
    signals = {row["scenario"]: SIGNALS[row["signal"]] for row in rows}
    followed = [
        f"{name} within {spanned([float(from_si(error, signals[name].unit, signals[name].si)) for error in errors])} "
        f"{signals[name].unit}"
        for name, errors in _by_scenario(rows, "limit_error").items()
    ]
    said = [f"The soonest that the optimiser finds, {_meshes(rows)}: {'; '.join(settled)}."] if settled else []
    said += [f"The nearest that the optimiser follows, root mean square: {'; '.join(followed)}."] if followed else []
    lacking = sum(row["limit_s"] is None and row["limit_error"] is None for row in rows)
    said += [f"No limit in {lacking} of {counted(len(rows), 'row')}; the table says why."] if lacking else []
    return " ".join(said)


def _meshes(rows: Sequence[Mapping[str, Any]]) -> str:
    """How far the last two meshes of the steps' limits differ at most."""
    found = [row for row in rows if row["limit_s"] is not None]
    if any(row["mesh_difference_s"] is None for row in found):
        return "some of it on one mesh alone"
    return f"on two meshes within {max(100 * row['mesh_difference_s'] / row['limit_s'] for row in found):.1g} %"


def _by_scenario(rows: Sequence[Mapping[str, Any]], key: str) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for row in rows:
        if row[key] is not None:
            found.setdefault(row["scenario"], []).append(row[key])
    return found


def _tracking_tables(metrics: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> list[Table]:
    """Of references that move: a table for each signal."""
    note = (
        "The least root mean square of the error over the scenario, from rest, with the reference known ahead. It is "
        "found by direct collocation in windows, and played by the engine: the same command limits, stroke and "
        f"pressures, {metrics['margin_bar']:g} bar above the vapour's. By the mesh: the change when its intervals are "
        "halved."
    )
    by_signal = {
        name: [row for row in rows if row["signal"] == name] for name in dict.fromkeys(r["signal"] for r in rows)
    }
    return [MetricView(SIGNALS[name]).table("", own, _MOVING, note) for name, own in by_signal.items()]


def _table(metrics: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> Table:
    """Of steps."""
    note = (
        "The least time from rest until a step is settled as a bench counts it, found by direct collocation on the "
        "known plant: command within 1 and its rate, the jack within stroke and speed, and no chamber less than "
        f"{metrics['margin_bar']:g} bar above the vapour's pressure, 0 bar here. Many motions arrive as soon; the one "
        "with the quietest command is shown, which costs some 0.2 % of the time. By the mesh: the change when its "
        "intervals were last halved, which is the error of a held command: coarse meshes promise too much. The optimum "
        "is a local one. Pressure, overshoot and the distance from what was found belong to the motion that the engine "
        "plays, open loop."
    )
    return MetricView().table("", rows, _STEPS, note)


def _scenarios(courses: Courses) -> list[str]:
    return list(dict.fromkeys(name.partition(" from ")[0] for name in courses))


def _figure(scenario: str, courses: Courses) -> Figure:
    """Its motions from every place: signals, command and chamber pressures."""
    runs = {name.partition(" from ")[2]: run for name, run in courses.items() if name.startswith(f"{scenario} from ")}
    panels = [
        Panel(SIGNALS[key].label, tuple(_curve(place, key, run) for place, run in runs.items() if key in run))
        for key in _SHOWN
        if any(key in run and np.ptp(run[key]) > 0 for run in runs.values())
    ]
    return Figure(f"{scenario}: the best that was found", "time [ms]", panels)


def _curve(name: str, key: str, run: Mapping[str, np.ndarray]) -> Curve:
    values = run[key] - run[key][0] if key == "position" else run[key]
    return Curve(name, 1e3 * run["t [s]"], from_si(values, SIGNALS[key].unit, SIGNALS[key].si))
