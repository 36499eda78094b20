"""The report of an experiment with sines: errors over frequency on every rig, and the share of drawn plants."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...loop.sines import AMPLITUDE, ARRIVES, JUDGED, PHASE
from ...report import Curve, Figure, Mark, Page, Panel, Section, Table
from ..common.judged import gas_words, played_words
from ..common.metric_table import MetricView
from .options import SinesConfig

WAYS = {"alone": "alone", "apc": "APC", "apc+ahc": "APC + AHC"}  # as metrics.json and as the report names them
_LOWEST = 1e-3  # % and deg: errors below are drawn there

Rows = Sequence[Mapping[str, Any]]


def page(config: SinesConfig, metrics: Mapping[str, Any], figure: Figure) -> Page:
    """The report."""
    rows = metrics["rows"]
    sections = [Section("Errors over frequency", [figure])]
    if metrics["plants"]:
        sections.append(Section("Drawn plants", [_plants(config, metrics)]))
    sections.append(Section("Where the valve saturates", [_reach(metrics["reach"])]))
    for spec in config.controllers:
        own = [row for row in rows if row["controller"] == spec.name]
        sections.append(Section(f"{spec.name} on the rigs", [_table(config, own)]))
    title = f"Sines of up to {1e3 * config.amplitude:g} mm on {config.rig.name}"
    return Page(title, _verdict(metrics), sections, {"seed": str(config.conditions.seed)})


def picture(config: SinesConfig, metrics: Mapping[str, Any]) -> Figure:
    """Errors of amplitude and phase, and the third harmonic, over frequency on the first rig."""
    first = next(iter(config.rigs))
    view = MetricView()
    marks = {"amplitude_error_percent": 100 * AMPLITUDE, "phase_error_deg": PHASE}
    rows = [row for row in metrics["rows"] if row["rig"] == first]
    panels = [
        Panel(view.head(key), _curves(rows, key), log_y=True, marks=[Mark(most, "asked for")])
        for key, most in marks.items()
    ]
    panels.append(Panel(view.head("third_db"), _curves(rows, "third_db")))
    return Figure(
        f"Sines on {first}", "frequency [Hz]", panels, log_x=True,
        note=f"true values over {JUDGED} cycles after the first {ARRIVES}; errors below {_LOWEST:g} are drawn there",
    )  # fmt: skip


def _curves(rows: Rows, key: str) -> list[Curve]:
    """One of each controller and way."""
    curves = []
    for name, way in dict.fromkeys((row["controller"], row["way"]) for row in rows):
        own = [r for r in rows if (r["controller"], r["way"]) == (name, way) and r[key] is not None]
        values = np.array([row[key] for row in own])
        shown = values if key == "third_db" else np.maximum(np.abs(values), _LOWEST)
        curves.append(Curve(f"{name}, {WAYS[way]}", np.array([row["frequency"] for row in own]), shown))
    return curves


def _verdict(metrics: Mapping[str, Any]) -> str:
    """Up to which frequency sines arrive on all rigs, which share of the plants, and where the valve saturates."""
    rows, weakest = metrics["rows"], min(metrics["reach"], key=lambda row: row["highest_hz"])
    parts = [
        f"{name} {WAYS[way]} {_up_to([r for r in rows if (r['controller'], r['way']) == (name, way)])}"
        for name, way in dict.fromkeys((row["controller"], row["way"]) for row in rows)
    ]
    words = f"Within {100 * AMPLITUDE:g} % and {PHASE:g} deg after {ARRIVES} cycles on all rigs: {', '.join(parts)}."
    if metrics["plants"]:
        every = dict.fromkeys(row["frequency"] for row in metrics["plants"])
        least = {f: min(r["within_percent"] for r in metrics["plants"] if r["frequency"] == f) for f in every}
        words += f" Drawn plants: {', '.join(f'{share:.3g} % at {f:g} Hz' for f, share in least.items())}."
    return words + (
        f" The valve of {weakest['rig']} gives {1e3 * weakest['amplitude']:g} mm up to {weakest['highest_hz']:.3g} Hz."
    )


def _up_to(rows: Rows) -> str:
    """Up to which frequency every row is within, in words."""
    every = sorted({row["frequency"] for row in rows})
    missed = min((row["frequency"] for row in rows if not row["within"]), default=np.inf)
    within = [f for f in every if f < missed]
    return f"up to {within[-1]:g} Hz" if within else "nowhere"


def _table(config: SinesConfig, rows: Rows) -> Table:
    keys = (
        *("rig", "frequency", "amplitude", "way", "amplitude_error_percent", "phase_error_deg", "third_db", "cycles"),
        *("peak_command", "cavitation_s", "lowest_pressure_bar", "tripped"),
    )
    lines = [{**row, "way": WAYS[row["way"]]} for row in rows]
    note = (
        f"True values over cycles {ARRIVES + 1} to {ARRIVES + JUDGED}. APC: amplitude and phase control; AHC: odd "
        f"harmonics up to {config.harmonics} times the frequency are taken out where the loop leaves room. "
        f"{played_words(config.conditions, config.rig)}{gas_words(rows)}"
    )
    return MetricView().table("", lines, keys, note)


def _plants(config: SinesConfig, metrics: Mapping[str, Any]) -> Table:
    keys = (
        *("controller", "frequency", "amplitude", "plants", "within_percent", "tripped", "amplitude_p99_percent"),
        *("amplitude_worst_percent", "phase_p99_deg", "phase_worst_deg"),
    )
    lines = [{**row, "controller": f"{row['controller']}, {WAYS[row['way']]}"} for row in metrics["plants"]]
    note = (
        f"Drawn over the rig's bounds and {', '.join(config.factors) or 'no factors'}, in {100 * config.stroke:g} % of "
        "the stroke."
    )
    if metrics["left_out"]:
        note += f" Not in lanes, and left out: {', '.join(metrics['left_out'])}."
    return MetricView().table("", lines, keys, note)


def _reach(rows: Rows) -> Table:
    note = "From rest at the ends of a sine to its middle the valve gives F (1 - (v/v0)^2)/M at a speed v."
    return MetricView().table("", rows, ("rig", "amplitude", "highest_hz"), note)
