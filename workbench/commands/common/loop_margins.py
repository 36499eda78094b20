"""Margins of linear loops: a table, the closed loop and the sensitivity, as several reports show them."""

from collections.abc import Mapping

from ...base.signals import Signal
from ...loop.margins import LinearLoop
from ...loop.rows import LinearLoops, linear_row, moving_at
from ...report import Figure, FrequencyCurve, Section, Style, Table, bode, sensitivity
from .metric_table import MetricView

SHOWN_HZ = (0.05, 100.0)
_KEYS = ("stable", "ms", "gain_margin_db", "phase_margin_deg", "margins", "f3db_hz", "f90_hz")


def margins_section(title: str, loops: Mapping[str, LinearLoops], signal: Signal) -> Section:
    """All of it, of loops by name."""
    curves = [curve for name, pair in loops.items() for curve in closed_curves(pair, signal, f"{name}, ")]
    return Section(
        title, [margins_table(loops, signal), bode("Closed loop, linear", curves), sensitivity_figure(loops)]
    )


def margins_table(loops: Mapping[str, LinearLoops], signal: Signal) -> Table:
    """A line a loop and operating point."""
    lines = [
        {"controller": name, "operating point": where, **linear_row(loop)}
        for name, pair in loops.items()
        for where, loop in (("null", pair.null), (f"moving at {moving_at(signal, pair.speed)}", pair.moving))
    ]
    note = "An unstable loop has no margins. A controller without a linear view has them by sines on the simulated "
    note += f"loop, or none.{slowed_words(loops, signal)}"
    return MetricView(signal).table(
        "Margins of the sampled loop", lines, ("controller", "operating point", *_KEYS), note
    )


def slowed_words(loops: Mapping[str, LinearLoops], signal: Signal) -> str:
    """A sentence, after a space, where a drive does not give the speed at which moving loops are judged; or empty."""
    pair = next((pair for pair in loops.values() if pair.speed != pair.asked), None)
    if pair is None:
        return ""
    asked, given = (moving_at(signal, speed) for speed in (pair.asked, pair.speed))
    return f" The drive does not give {asked}: loops that move are judged at {given}."


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
        FrequencyCurve(name, pair.null.f, pair.null.sensitivity)
        for name, pair in loops.items()
        if pair.null.sensitivity is not None
    ]
    return sensitivity("Sensitivity at null", curves)
