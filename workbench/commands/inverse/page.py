"""What an inverse shows: its gain, what it leaves of a reference, the record, and the outer loop."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.signals import Signal
from ...base.units import from_si
from ...base.words import counted, spanned
from ...loop.designed_inverse import ReferenceInverse
from ...loop.learning import Iteration
from ...loop.margins import LinearLoop
from ...loop.rows import LinearLoops
from ...records.frequency_sheet import table_text
from ...report import Curve, Figure, FrequencyCurve, Mark, Page, Panel, Section, Table, bode, gains
from ..common.fitted_plant import with_fit
from ..common.judged import gas_words
from ..common.metric_table import MetricView
from ..common.time_figure import signal_panel
from .drawn import DrawnErrors
from .options import InverseConfig

LOWEST, HIGHEST = 0.1, 100.0  # Hz, of figures


@dataclass(frozen=True, eq=False)
class Inverted:
    """The inverse before a controller, the linear loops of each rig, the record as it is and filtered, the outer loops
    by rig, and the errors on drawn plants."""

    controller: str
    inverse: ReferenceInverse
    loops: Mapping[str, LinearLoops]
    runs: Mapping[str, Mapping[str, Iteration]]
    outers: Mapping[str, Mapping[tuple[str, str], LinearLoop]]
    drawn: DrawnErrors | None


def tables(config: InverseConfig, inverted: Mapping[str, Inverted]) -> dict[str, dict[str, np.ndarray]]:
    """The taps of each inverse, and how many samples ahead they look; the errors on the drawn plants."""
    ahead = config.preview - np.arange(config.taps)
    taps = {f"taps-{name}": {"ahead": ahead, "tap": each.inverse.taps} for name, each in inverted.items()}
    plants = {
        f"plants-{name}": each.drawn.draw.columns(config.rig)
        | {"error_rms": each.drawn.as_it_is, "error_rms_inverse": each.drawn.inverse}
        for name, each in inverted.items()
        if each.drawn is not None
    }
    return taps | plants


def drive_file(config: InverseConfig, inverted: Inverted) -> dict[str, str]:
    """The record as one inverse filters it, deviations from the start."""
    drive = inverted.inverse.filtered(config.reference)
    t = np.arange(len(drive)) * config.rig.period.value
    return {f"drive-{inverted.controller}.csv": table_text({"t": t, config.signal.name: drive})}


def page(
    config: InverseConfig, inverted: Mapping[str, Inverted], metrics: Mapping[str, Any], drawn: list[Section]
) -> Page:
    """The report; `drawn`: its section of drawn plants."""
    record, ahead = config, config.preview * config.rig.period.value * 1e3
    rows = {name: [row for row in metrics["rows"] if row["controller"] == name] for name in inverted}
    changes = "; ".join(f"before {name} it {changed(config.signal, each)}" for name, each in rows.items())
    verdict = (
        f"The inverse looks {ahead:g} ms ahead, and is designed on {len(config.designed_on)} of "
        f"{counted(len(record.rigs), 'rig')}. Of {record.scenario.name}, {changes}."
    )
    parts = inverted.values()
    sections = [
        Section("The record", [_errors(config, metrics), *(_record(config, each) for each in parts)]),
        *drawn,
        Section(
            "The inverse",
            [figure for each in parts for figure in (gain_figure(each.inverse, each.controller), left_figure(each))],
        ),
    ]
    if config.outer is not None:
        verdict += f" {_outer_verdict(metrics)}"
        sections.append(
            Section("The loop through the reference", [_outer_table(metrics), *(_outer_figure(each) for each in parts)])
        )
    title = f"An inverse before {' and '.join(inverted)} on {record.rig.name}"
    return with_fit(Page(title, verdict, sections), record.rig)


def changed(signal: Signal, rows: Sequence[Mapping[str, Any]]) -> str:
    """What an inverse makes of the error on the rigs of the `rows`, in words."""
    divided = [row["factor"] for row in rows if row["factor"] >= 1]
    grown = [1 / row["factor"] for row in rows if row["factor"] < 1]
    where = [
        f" on {len(each)} of {counted(len(rows), 'rig')}" if divided and grown else "" for each in (divided, grown)
    ]
    parts = [f"divides the error by {spanned(divided)}{where[0]}"] if divided else []
    parts += [f"makes the error {spanned(grown)} times as large{where[1]}"] if grown else []
    both = ([from_si(row[key], signal.unit, signal.si) for row in rows] for key in ("error_rms", "error_rms_inverse"))
    before, after = (spanned(map(float, each)) for each in both)
    return f"{' and '.join(parts)}, which is {before} {signal.unit} RMS without and {after} {signal.unit} with it"


def _outer_verdict(metrics: Mapping[str, Any]) -> str:
    """At null and moving alike: the worse of both counts."""
    without, with_it = ([row for row in metrics["outer"] if row["reference"] == how] for how in ("as it is", "inverse"))
    unstable = [sum(not row["stable"] for row in rows) for rows in (without, with_it)]
    said = (
        f"The loop through the reference is unstable at {unstable[0]} of {len(without)} operating points without the "
        f"inverse, at {unstable[1]} with it."
    )
    worst = [
        (min(row["gain_margin_db"] for row in rows), max(row["ms"] for row in rows))
        for rows in (without, with_it)
        if all(None not in (row["gain_margin_db"], row["ms"]) for row in rows)
    ]
    if len(worst) < 2:
        return said
    (margin, ms), (margin_with, ms_with) = worst
    return (
        f"{said} At the worse of null and moving its gain margin is {margin:.3g} dB without and {margin_with:.3g} dB "
        f"with it, and Ms {ms:.3g} and {ms_with:.3g}."
    )


def _errors(config: InverseConfig, metrics: Mapping[str, Any]) -> Table:
    keys = ("controller", "rig", "designed on", "error_rms", "error_rms_inverse", "factor", "peak_command", "tripped")
    rows = [{**row, "designed on": row["rig"] in config.designed_on} for row in metrics["rows"]]
    view = MetricView.of(config.rig, config.signal)
    note = f"True errors, with noise and computing delay.{gas_words(rows)}"
    return view.table("Error of the record", rows, keys, note)


def _seen(f: np.ndarray) -> np.ndarray:
    return (f >= LOWEST) & (f <= HIGHEST)


def left_figure(inverted: Inverted) -> Figure:
    """|1 - H T| of each rig at null, and |1 - T| of the first."""
    curves = []
    for name, loops in inverted.loops.items():
        band = _seen(loops.null.f)
        curves.append(FrequencyCurve(name, loops.null.f[band], inverted.inverse.left(loops.null)[band]))
    first = next(iter(inverted.loops.values())).null
    if first.closed is not None:
        band = _seen(first.f)
        curves.append(FrequencyCurve("as it is", first.f[band], 1 - first.closed[band], "dash"))
    title = f"{inverted.controller}: what is left of a reference, linear at null"
    return gains(title, curves, "error over reference [dB]", marks=[Mark(0.0)])


def gain_figure(inverse: ReferenceInverse, controller: str = "") -> Figure:
    """Gain and phase of an inverse, before a `controller`."""
    f = np.geomspace(LOWEST, min(HIGHEST, 0.5 / inverse.period), 500)
    h = inverse.response(f)
    panels = [
        Panel("gain [dB]", [Curve("inverse", f, gain_db(h))]),
        Panel("phase [deg]", [Curve("inverse", f, phase_deg(h))]),
    ]
    title = f"The inverse before {controller}" if controller else "The inverse"
    return Figure(title, "frequency [Hz]", panels, log_x=True)


def _record(config: InverseConfig, inverted: Inverted) -> Figure:
    """The record on the first rig."""
    name, run = next(iter(inverted.runs.items()))
    signal, reference = config.signal, config.reference
    t = np.arange(len(reference)) * config.rig.period.value
    true = {how: (t[: len(each.true)], each.true) for how, each in run.items()}
    errors = {how: (own, reference[: len(values)] - values) for how, (own, values) in true.items()}
    panels = [signal_panel(signal, {"reference": (t, reference), **true}), signal_panel(signal, errors, "error")]
    return Figure(f"{config.scenario.name} by {inverted.controller} on {name}", "time [s]", panels)


def _outer_table(metrics: Mapping[str, Any]) -> Table:
    heads = ["controller", "rig", "operating point", "reference", "stable", "Ms", "gain margin [dB]",
             "phase margin [deg]", "inner Ms", "inner gain margin [dB]"]  # fmt: skip
    note = "The loop opened at the reference, its poles together with those of the inner loop."
    return Table("Margins", heads, [list(row.values()) for row in metrics["outer"]], note)


def _outer_figure(inverted: Inverted) -> Figure:
    """The open outer loop of the first rig at null."""
    outers = next(iter(inverted.outers.values()))
    curves = []
    for (point, how), loop in outers.items():
        if point == "null":
            band = _seen(loop.f)
            curves.append(FrequencyCurve(how, loop.f[band], loop.open[band]))
    return bode(f"{inverted.controller}: the loop through the reference, opened there, first rig at null", curves)
