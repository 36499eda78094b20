"""The report of a drive: measured beside predicted, scenario by scenario."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ...base.words import counted
from ...loop.scenarios import Scenario
from ...report import Figure, Page, Section, Table
from ..common.limits_told import limits_section, trip_marks
from ..common.metric_table import MetricView
from ..common.step_experiment import StepConfig
from ..common.time_figure import time_figure

if TYPE_CHECKING:
    from ...link.course import Judged

_FIGURES = ("settling_s", "overshoot_percent", "peak_command")


def drive_page(config: StepConfig, metrics: Mapping[str, Any], judged: Sequence["Judged"]) -> tuple[Page, Figure]:
    """The report and its telling figure, an empty one where nothing was played."""
    figures = [_figure(config, each) for each in judged]
    refused = [
        f"{each['controller']}, {each['scenario']} was not played: {each['why']}." for each in metrics["refused"]
    ]
    sections = [
        Section("Measured and predicted", [_table(config, judged)]),
        Section("Time responses", figures),
        limits_section(config.rig, refused),
    ]
    page = Page(f"{config.signal.name.capitalize()} loops at {metrics['rig']}", _verdict(metrics, judged), sections)
    return page, figures[0] if figures else Figure("nothing was played", "time [s]", [])


def _verdict(metrics: Mapping[str, Any], judged: Sequence["Judged"]) -> str:
    words = f"{counted(len(judged), 'run')} at {metrics['rig']}, measured and judged."
    if judged:
        first = judged[0]
        here, there = (settled(first.scenario, row) for row in (first.row, first.prediction))
        words += f" {first.scenario.name} under {first.controller} {here}; predicted: {there}."
    if metrics["late"]:
        words += f" {metrics['late']} readings were lost or late."
    if metrics["ended"]:
        words += f" Playing was cut short: {metrics['ended']}."
    if metrics["refused"]:
        words += f" Refused for what is foreseen: {len(metrics['refused'])}; see the limits."
    if metrics["left_out"]:
        words += f" Left out, as a command alone cannot play them: {', '.join(metrics['left_out'])}."
    return words


def settled(scenario: Scenario, row: Mapping[str, Any]) -> str:
    """Whether a run settles, as far as it tells: one that is cut short, and a course that never stands, do not."""
    if row["settling_s"] is not None:
        return f"settles in {row['settling_s']:.3g} s"
    if row["tripped"] is not None:
        return "is cut short"
    return "is followed" if scenario.arrives is None else "does not settle"


def _table(config: StepConfig, judged: Sequence["Judged"]) -> Table:
    view, lines = MetricView.of(config.rig, config.signal, config.scenarios), []
    heads = ["scenario", "controller"]
    heads += [f"{view.head(key)}, {what}" for key in _FIGURES for what in ("measured", "predicted")]
    for each in judged:
        cells = [view.cell(row, key) for key in _FIGURES for row in (each.row, each.prediction)]
        lines.append([each.scenario.name, each.controller, *cells])
    note = (
        "Measured: what the rig's sensors read, its settling and overshoot from a running mean over 8 ms. Predicted: "
    )
    note += "the experiment's rig in simulation, with the delay of the link."
    return Table("", heads, lines, note)


def _figure(config: StepConfig, each: "Judged") -> Figure:
    runs = {"measured": each.measured.record, "predicted": each.predicted.record}
    title = f"{each.scenario.name}, {each.controller}"
    marks = trip_marks(each.trip and each.trip.t)
    rows = [each.row, each.prediction]
    return time_figure(title, config.signal, runs, ("command", "pa"), each.scenario, rows, marks)
