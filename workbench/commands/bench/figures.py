"""The figures of a bench: time responses, clouds over the rigs, closed loop, sensitivity, stiffness."""

from collections.abc import Mapping

import numpy as np

from ...loop.scenarios import Scenario
from ...report import Curve, Figure, FrequencyCurve, Panel, bode, sensitivity
from ..common.bench_experiment import BenchLoop
from ..common.metric_table import MetricView
from ..common.sines import closed_loop_figure
from ..common.time_figure import time_figure
from .entry import STIFFNESS_HZ, Entries

SHOWN_HZ = (0.05, 100.0)


def excursion(scenario: Scenario) -> str:
    """The metric that tells how far a loop goes astray: a load alone has no step to overshoot, but pushes the jack off
    its place."""
    return "overshoot_percent" if scenario.size else "peak_deviation"


def time_responses(loop: BenchLoop, scenario: Scenario, rig: str, entries: Entries) -> Figure:
    """One scenario on one rig under every controller: controlled signal, command, pressure."""
    own = {spec.name: entries[spec.name, rig] for spec in loop.controllers}
    runs = {name: each["courses"][scenario.name] for name, each in own.items()}
    rows = [row for each in own.values() for row in each["rows"]]
    return time_figure(f"{scenario.name} on {rig}", loop.signal, runs, ("command", "pa"), scenario, rows)


def spread_scatter(loop: BenchLoop, scenario: Scenario, entries: Entries) -> Figure:
    """Overshoot, or what a load pushes, against settling, a mark a rig: those of a robust controller are close."""
    i, far, view = loop.scenarios.index(scenario), excursion(scenario), MetricView.of(loop.rig, loop.signal)
    curves = []
    for controller in loop.controllers:
        rows = [entries[controller.name, rig]["rows"][i] for rig in loop.rigs]
        settled = [row for row in rows if row["settling_s"] is not None]
        at = np.array([[row["settling_s"], view.number(row, far)] for row in settled], float).reshape(-1, 2)
        curves.append(Curve(controller.name, at[:, 0], at[:, 1], "markers"))
    note = f"A mark for each of {', '.join(loop.rigs)}; none where a loop does not settle."
    panel = Panel(view.head(far), curves)
    return Figure(f"{scenario.name}: spread", view.head("settling_s"), [panel], log_x=True, note=note, height=420)


def linear_figures(loop: BenchLoop, rig: str, entries: Entries) -> list[Figure]:
    """Bode plot of the closed loops, and their sensitivity; an unstable loop has neither."""
    there = linear_columns(loop, rig, entries)
    closed, sensitive = [], []
    for name, columns in there.items():
        f = columns["f_hz"]
        shown = (f > SHOWN_HZ[0]) & (f < SHOWN_HZ[1])
        closed.append(FrequencyCurve(name, f[shown], complex_column(columns, "closed")[shown]))
        sensitive.append(FrequencyCurve(name, f[shown], complex_column(columns, "sensitivity")[shown]))
    return [bode("Closed loop", closed), sensitivity("Sensitivity", sensitive)] if there else []


def sine_figures(loop: BenchLoop, entries: Entries) -> list[Figure]:
    """For each controller on the first rig: the linear closed loop, and what sines of several sizes find."""
    linear, rig = linear_columns(loop, loop.first, entries), loop.first
    figures = []
    for controller in loop.controllers:
        dashed = []
        if columns := linear.get(controller.name):
            shown = (columns["f_hz"] > SHOWN_HZ[0]) & (columns["f_hz"] < SHOWN_HZ[1])
            dashed.append(
                FrequencyCurve("linear, null", columns["f_hz"][shown], complex_column(columns, "closed")[shown], "dash")
            )
        figures.append(closed_loop_figure(controller.name, dashed, entries[controller.name, rig]["sines"]))
    return figures


def stiffness_figure(loop: BenchLoop, rig: str, entries: Entries) -> Figure:
    """Disturbance force over position, linear, at null."""
    stiffness = {c.name: entries[c.name, rig]["stiffness"] for c in loop.controllers}
    curves = [Curve(name, STIFFNESS_HZ, size / 1e6) for name, size in stiffness.items() if size is not None]
    panel = Panel("dynamic stiffness [kN/mm]", curves, log_y=True)
    return Figure(f"Dynamic stiffness on {rig}", "frequency [Hz]", [panel], log_x=True)


def linear_columns(loop: BenchLoop, rig: str, entries: Entries) -> dict[str, dict[str, np.ndarray]]:
    """Columns of the stable linear loops."""
    responses = {c.name: entries[c.name, rig]["linear"] for c in loop.controllers}
    return {name: columns for name, columns in responses.items() if columns is not None}


def complex_column(columns: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    return columns[f"{name}_real"] + 1j * columns[f"{name}_imag"]
