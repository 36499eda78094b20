"""Nichols charts of a bench: open loops on the first rig, and over the stroke on every rig."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db
from ...loop.scenarios import Limits
from ...report import Curve, Figure, Panel, Style, outline_points
from ..common.bench_experiment import BenchLoop
from .entry import Entries
from .figures import SHOWN_HZ, complex_column, linear_columns

_DAMPINGS = (0.1, 0.2, 0.3, 0.4, 0.5)
_CLOSED_DB = (-3.0, -6.0)
_NEAR = (0.4, 0.1)  # deg, dB: less than a pixel of a chart


def nichols(loop: BenchLoop, rig: str, entries: Entries) -> Figure:
    """Open loops at the command over contours of constant closed-loop gain, some named by the damping of their peak."""
    curves = _contours()
    for name, columns in linear_columns(loop, rig, entries).items():
        f = columns["f_hz"]
        curves.append(_on_chart(name, complex_column(columns, "open")[f > SHOWN_HZ[0]]))
    note = (
        "The loop is broken at the command. A contour is where L/(1 + L) has one gain: that of the resonance of a "
        "second-order loop of the damping that it is named by, or in decibels."
    )
    panel = Panel("open-loop gain [dB]", curves, y_range=(-40.0, 40.0))
    return Figure(f"Nichols chart on {rig}", "open-loop phase [deg]", [panel], note=note, height=560)


def nichols_cloud(name: str, columns: Mapping[str, Any]) -> Figure:
    """Open loops of a controller at null on every plant of the envelope, a curve a rig with a line a position."""
    loops, f = complex_column(columns, "open"), columns["f_hz"]
    rigs = {rig: [i for i, other in enumerate(columns["rigs"]) if other == rig] for rig in columns["rigs"]}
    curves = [_cloud(rig, loops[lanes]) for rig, lanes in rigs.items()]
    limit = Limits().ms
    around = np.exp(1j * np.linspace(0, 2 * np.pi, 721)) / limit - 1
    circle = replace(_on_chart(f"Ms {limit:g}", around), style="dash", color="#57606a")
    panel = Panel("open-loop gain [dB]", [circle, *curves], y_range=(-30.0, 30.0))
    note = f"At null, from {f[0]:g} to {f[-1]:g} Hz; a line a position."
    return Figure(
        f"{name}: Nichols chart over stroke and rigs", "open-loop phase [deg]", [panel], note=note, height=380
    )


def _cloud(name: str, loops: np.ndarray) -> Curve:
    """Loops [lanes, k] as one curve with gaps."""
    parts = [_on_chart(name, np.append(loop, np.nan)) for loop in loops]
    return Curve(name, np.concatenate([part.x for part in parts]), np.concatenate([part.y for part in parts]))


def _contours() -> list[Curve]:
    resonances = {zeta: -20 * np.log10(2 * zeta * np.sqrt(1 - zeta**2)) for zeta in _DAMPINGS}
    curves = [_contour(f"damping {zeta:g}", level, "dot") for zeta, level in resonances.items()]
    return curves + [_contour(f"{level:g} dB", level, "dash") for level in _CLOSED_DB]


def _contour(name: str, level: float, style: Style) -> Curve:
    """L where |L/(1 + L)| is `level` [dB]."""
    closed = 10 ** (level / 20) * np.exp(1j * np.linspace(0.001, 2 * np.pi - 0.001, 400))
    return replace(_on_chart(name, closed / (1 - closed)), style=style, color="#afb8c1")


def _on_chart(name: str, loop: np.ndarray) -> Curve:
    """Gain [dB] over phase [deg] in (-360, 0], with a gap where the phase leaves the chart and comes back."""
    phase = -np.mod(-np.degrees(np.angle(loop)), 360)
    gain = gain_db(loop)
    gain[1:][np.abs(np.diff(phase)) > 180] = np.nan
    drawn = outline_points(phase, gain, *_NEAR)
    return Curve(name, phase[drawn].round(2), gain[drawn].round(3))
