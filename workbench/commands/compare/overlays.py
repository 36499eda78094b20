"""The curves of finished runs, overlaid: steps, Bode plots, sensitivities, errors of records."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...loop.scenarios import SCENARIOS
from ...report import Curve, Figure, FrequencyCurve, Panel, bode, sensitivity
from ..common.time_figure import time_figure
from .finished import Finished

_SHOWN_HZ = 100.0  # linear curves run to the Nyquist frequency, where nothing is read off


def _curves(runs: Sequence[Finished], prefix: str) -> dict[str, list[tuple[str, dict[str, np.ndarray]]]]:
    """Tables PREFIX-CONTROLLER-REST as (label, columns), grouped by REST; groups of a single run are left out."""
    groups: dict[str, list[tuple[str, str, dict[str, np.ndarray]]]] = {}
    for run in runs:
        for table in (name for name in run.tables if name.startswith(f"{prefix}-")):
            rest = table.removeprefix(f"{prefix}-")
            owner = next((name for name in run.controllers if rest == name or rest.startswith(f"{name}-")), "")
            label = f"{run.name}: {owner}" if owner else run.name
            groups.setdefault(rest.removeprefix(owner).lstrip("-"), []).append((run.name, label, run.read(table)))
    return {
        rest: [(label, columns) for _, label, columns in group]
        for rest, group in groups.items()
        if len({name for name, _, _ in group}) > 1
    }


def steps(runs: Sequence[Finished]) -> Iterator[Figure]:
    """Steps of a scenario that several runs have."""
    for rest, group in _curves(runs, "step").items():
        scenario, of = SCENARIOS.get(rest), [row for run in runs for row in run.rows]
        signal = SIGNALS[scenario.signal if scenario else "position"]
        yield time_figure(f"Step: {rest}", signal, dict(group), ("command",), scenario, of)


def bodes(runs: Sequence[Finished]) -> Iterator[Figure]:
    """Closed loops by stepped sine and linear, and Bode tables of one name."""
    for rest, group in _curves(runs, "sine").items():
        curves = [FrequencyCurve(label, c["f_hz"], c["real"] + 1j * c["imag"], "points") for label, c in group]
        yield bode(f"Closed loop by stepped sine, {rest}", curves)
    for rest, group in _curves(runs, "linear").items():
        curves = [FrequencyCurve(n, c["f_hz"], c["closed_real"] + 1j * c["closed_imag"]) for n, c in _low(group)]
        yield bode(" ".join(("Closed loop, linear at null", rest)).strip(), curves)
    for table in dict.fromkeys(name for run in runs for name in run.tables):
        sharing = [(run.name, run.read(table)) for run in runs if table in run.tables]
        curves = [
            FrequencyCurve(name, c["f_hz"], 10 ** (c["gain_db"] / 20) * np.exp(1j * np.radians(c["phase_deg"])))
            for name, c in sharing
            if {"f_hz", "gain_db", "phase_deg"} <= c.keys()
        ]
        if len(curves) > 1:
            yield bode(table, curves)


def sensitivities(runs: Sequence[Finished]) -> Iterator[Figure]:
    """|S| of the runs' loops at null."""
    for rest, group in _curves(runs, "linear").items():
        curves = [
            FrequencyCurve(label, c["f_hz"], c["sensitivity_real"] + 1j * c["sensitivity_imag"]) for label, c in group
        ]
        yield sensitivity(" ".join(("Sensitivity at null", rest)).strip(), curves)


def _low(group: Sequence[tuple[str, dict[str, np.ndarray]]]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    for label, columns in group:
        yield label, {name: values[columns["f_hz"] < _SHOWN_HZ] for name, values in columns.items()}


def residuals(runs: Sequence[Finished]) -> Iterator[Figure]:
    """Errors of the records that runs share, one panel a signal."""
    for record, group in _curves(runs, "residual").items():
        heads = dict.fromkeys(head for _, columns in group for head in columns if head.startswith("error "))
        panels = [Panel(head, [Curve(label, c["t [s]"], c[head]) for label, c in group if head in c]) for head in heads]
        yield Figure(f"Error: {record}", "time [s]", panels)


def bars(runs: Sequence[Finished], rows: Sequence[Mapping[str, Any]]) -> Figure:
    """The differences in percent, row by row, for runs without curves."""
    count = np.arange(1, len(rows) + 1)
    curves = [
        Curve(run.name, count, np.array([row["percent"].get(run.name) for row in rows], dtype=float), "markers")
        for run in runs[1:]
    ]
    return Figure("Differences", "row", [Panel(f"difference from {runs[0].name} [%]", curves)])
