"""Envelopes as people hang them on the wall: speed over frequency, on which displacement and acceleration are lines."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...loop.performance.bounds import PerformanceEnvelope
from ...loop.performance.reached import Followed, Reached
from ...report import Curve, Figure, Panel, Style

_DEEP = 1e-3  # of the largest speed, down to which a picture goes
_PALE, _INK = "#afb8c1", "#24292f"
_WIDE, _NEAR = 1.15, 3.0  # of the largest speed; of the envelope, within which a bound is drawn


@dataclass(frozen=True)
class Shown:
    """The units in which a motion is shown, and what a unit of SI is in them: of displacement and speed, and of
    acceleration."""

    unit: str
    scale: float
    acceleration: str
    faster: float


LENGTH = Shown("mm", 1e3, "m/s²", 1.0)
ANGLE = Shown("deg", 180 / np.pi, "deg/s²", 180 / np.pi)


def tripartite(
    title: str, whole: PerformanceEnvelope, shown_in: Shown, more: Iterable[Curve] = (), note: str = ""
) -> Figure:
    """The speed of the largest sine, each bound by itself, and further curves of a speed as shown."""
    f, w, unit, scale = whole.f, 2 * np.pi * whole.f, shown_in.unit, shown_in.scale
    speed = scale * w * whole.amplitude
    top = _WIDE * float(speed.max())
    low = max(_DEEP * top, 0.5 * float(speed.min()))
    curves = [*_lines(f, (low, top), shown_in), Curve("envelope", f, speed, color=_INK)]
    curves += [
        Curve(name, f, np.where(shown < top, shown, np.nan), "dash")
        for name, values in whole.bounds.items()
        if np.any(values < _NEAR * whole.amplitude) and (shown := scale * w * values).min() < top
    ]
    panel = Panel(f"speed, amplitude [{unit}/s]", [*curves, *more], log_y=True, y_range=(low, top))
    return Figure(title, "frequency [Hz]", [panel], log_x=True, height=450, note=note)


def force_picture(whole: PerformanceEnvelope) -> Figure:
    """Force at the load cell or the piston, of the same sines."""
    force, what = (whole.cell, "load cell") if whole.cell.any() else (whole.pressure, "piston")
    curve = Curve("envelope", whole.f, force * whole.amplitude / 1e3)
    return Figure(f"Force at the {what}", "frequency [Hz]", [Panel("amplitude [kN]", [curve], log_y=True)], log_x=True)


def motions(whole: PerformanceEnvelope, shown_in: Shown) -> Figure:
    """Displacement and acceleration of the largest sine."""
    size, acceleration = whole.amplitude, (2 * np.pi * whole.f) ** 2 * whole.amplitude
    panels = [
        Panel(f"{what} [{unit}]", [Curve("envelope", whole.f, values)], log_y=True)
        for what, unit, values in (
            ("displacement", shown_in.unit, shown_in.scale * size),
            ("acceleration", shown_in.acceleration, shown_in.faster * acceleration),
        )
    ]
    return Figure("The same as displacement and acceleration", "frequency [Hz]", panels, log_x=True)


def speeds(name: str, f: np.ndarray, amplitude: np.ndarray, style: Style, shown_in: Shown = LENGTH) -> Curve:
    """A curve of amplitudes [k] m or rad as speeds [k]."""
    return Curve(name, f, shown_in.scale * 2 * np.pi * f * amplitude, style)


def followed_curves(name: str, own: Followed, shown_in: Shown = LENGTH) -> list[Curve]:
    """What the loop called `name` follows of an envelope."""
    kinds = {"amplitude": own.amplitude, "error": own.error}
    return [speeds(f"{name}, {kind} within 5 %", own.f, size, "points", shown_in) for kind, size in kinds.items()]


def reached_curves(reached: Sequence[Reached], shown_in: Shown = LENGTH) -> list[Curve]:
    """What the engine reached, and what it did not."""
    curves = []
    for there, name in ((True, "reached on the engine"), (False, "not reached")):
        points = [each for each in reached if each.there == there]
        if points:
            f, size = (np.array([getattr(each, key) for each in points]) for key in ("f", "amplitude"))
            curves.append(speeds(name, f, size, "markers", shown_in))
    return curves


def _lines(f: np.ndarray, shown: tuple[float, float], shown_in: Shown) -> list[Curve]:
    """Decades of displacement rise, decades of acceleration fall; each a curve with gaps between its lines."""
    w, faster = 2 * np.pi * f, shown_in.faster / shown_in.scale
    rising = _decades(shown[0] / w[-1], shown[1] / w[0])
    falling = _decades(faster * shown[0] * w[0], faster * shown[1] * w[-1])
    families = {
        f"{_listed(rising[::-1])} {shown_in.unit}, from right to left": rising,
        f"{_listed(falling)} {shown_in.acceleration}, from left to right": [size / faster for size in falling],
    }
    curves = []
    for (name, sizes), power in zip(families.items(), (1, -1), strict=True):
        values = [np.append(size * w**power, np.nan) for size in sizes]
        inside = [np.where((v >= shown[0]) & (v <= shown[1]), v, np.nan) for v in values]
        x = np.tile(np.append(f, f[-1]), len(sizes))
        curves.append(Curve(name, x, np.concatenate(inside), "dot", color=_PALE))
    return curves


def _listed(sizes: Sequence[float]) -> str:
    return ", ".join(f"{size:g}" for size in sizes)


def _decades(low: float, high: float) -> list[float]:
    return [10.0**power for power in range(int(np.ceil(np.log10(low))), int(np.floor(np.log10(high))) + 1)]
