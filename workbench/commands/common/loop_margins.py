"""Margins of linear loops: a table, the closed loop and the sensitivity, as several reports show them."""

from collections.abc import Mapping, Sequence

from ...base.gain_phase import gain_db, phase_deg
from ...base.signals import Signal
from ...linear.crossings import corner_frequency
from ...loop.margins import LinearLoop
from ...loop.rows import LinearLoops, moving_at
from ...report import Curve, Figure, FrequencyCurve, Known, Panel, Section, Style, Table, bode
from ...report.table import Cell

SHOWN_HZ = (0.05, 100.0)
_HEADS = ("controller", "operating point", "stable", "Ms [1]", "gain margin [dB]", "phase margin [deg]", "margins by")


def margins_section(title: str, loops: Mapping[str, LinearLoops], signal: Signal) -> Section:
    """All of it, of loops by name."""
    curves = [curve for name, pair in loops.items() for curve in closed_curves(pair, signal, f"{name}, ")]
    return Section(
        title, [margins_table(loops, signal), bode("Closed loop, linear", curves), sensitivity_figure(loops)]
    )


def margins_table(loops: Mapping[str, LinearLoops], signal: Signal) -> Table:
    """A line a loop and operating point."""
    lines = [
        [name, where, *_margins(loop)]
        for name, pair in loops.items()
        for where, loop in (("null", pair.null), (f"moving at {moving_at(signal, pair.speed)}", pair.moving))
    ]
    note = "An unstable loop has no margins. A controller without a linear view has them by sines on the simulated "
    note += "loop, or none."
    return Table("Margins of the sampled loop", [*_HEADS, "-3 dB [Hz]", "-90° [Hz]"], lines, note, fold=True)


def _margins(loop: LinearLoop) -> list[Cell]:
    corners: Sequence[float | None] = (None, None)
    if loop.closed is not None:
        gain, phase = gain_db(loop.closed), phase_deg(loop.closed)
        corners = corner_frequency(loop.f, gain, -3.0), corner_frequency(loop.f, phase, -90.0)
    numbers = ((loop.ms, 0.01), (loop.gain_margin_db, 0.01), (loop.phase_margin_deg, 0.1))
    shown = [None if value is None else Known(value, step) for value, step in numbers]
    return [loop.stable, *shown, loop.margins, *corners]


def closed_curves(loops: LinearLoops, signal: Signal, name: str = "linear, ") -> list[FrequencyCurve]:
    """The closed loops at null and moving that are stable, `name` before where they are; moving is dashed."""
    points: tuple[tuple[str, LinearLoop, Style], ...] = (
        ("null", loops.null, "line"),
        (moving_at(signal, loops.speed), loops.moving, "dash"),
    )
    low, high = SHOWN_HZ
    return [
        FrequencyCurve(f"{name}{where}", loop.f[shown], loop.closed[shown], style)
        for where, loop, style in points
        if loop.closed is not None
        for shown in [(loop.f > low) & (loop.f < high)]
    ]


def sensitivity_figure(loops: Mapping[str, LinearLoops]) -> Figure:
    """|S| at null, of the loops that are stable there."""
    curves = [
        Curve(name, pair.null.f, gain_db(pair.null.sensitivity))
        for name, pair in loops.items()
        if pair.null.sensitivity is not None
    ]
    return Figure("Sensitivity at null", "frequency [Hz]", [Panel("|S| [dB]", curves)], log_x=True)
