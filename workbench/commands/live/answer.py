"""What a view shows, in the units that people are shown, as the page's script reads it."""

from base64 import b64encode
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.signals import Signal
from ...base.units import from_si
from ...loop.plant_lanes import PlantLanes
from .after import AfterPart
from .view import LinearPart, LiveTask, StepPart, band_of, missed_goals, missed_words, within_words

_LOWEST = 0.1  # Hz, of what is shown
_PIXEL = 2e-3  # of an axis: what a point may be off the line between its neighbours and be left out
_POINTS = 2000  # of a curve over time, at most
_HIGHEST = 200.0  # Hz, of what is shown of the closed loop
_LEAST, _MOST, _LAST = -32.0, 30.0, -450.0  # dB and deg: where the axes of open loops end
_DEEPEST, _TOP = -60.0, 60.0  # dB: where the axis of the closed loop ends
Range = tuple[float, float]


def view_answer(lanes: PlantLanes, linear: LinearPart | None, steps: StepPart | None, task: LiveTask) -> dict[str, Any]:
    """Rows of numbers, one a rig, with what is out of the goals, and the curves."""
    rows: list[dict[str, Any]] = [{"rig": name} for name in lanes.names]
    for lane, row in enumerate(rows):
        if linear is not None:
            row |= _linear_row(linear, lane)
        if steps is not None:
            row |= _step_row(steps, lane, task.signal)
    missed = missed_goals(linear, steps, task.limits)
    for miss in missed:
        rows[miss.lane].setdefault("out", []).append(miss.column)
    return {
        "rows": rows,
        "missed": missed_words(lanes.names, missed),
        "within": within_words(lanes.names, linear, steps, task.limits),
        "linear": None if linear is None else _responses(linear),
        "steps": None if steps is None else _courses(steps, lanes, task),
    }


def after_answer(part: AfterPart, signal: Signal) -> dict[str, Any]:
    """The closed loop by sines, and which rigs hunt: None where that was not looked at."""
    sines = part.sines
    curves = sines and (gain_db(sines.response[signal.name]), phase_deg(sines.response[signal.name]))
    shown = (sines and curves) and {
        "f": packed(sines.f),
        "gain": packed(curves[0]),
        "phase": packed(curves[1]),
        "axes": _bode_axes(*curves),
        "amplitude": f"{float(from_si(sines.amplitude, signal.unit, signal.si)):g} {signal.unit}",
        "limited": number(float(sines.f[sines.saturated].min())) if np.any(sines.saturated) else None,
    }
    return {"sines": shown, "hunting": None if part.hunting is None else part.hunting.tolist()}


def _linear_row(linear: LinearPart, lane: int) -> dict[str, Any]:
    names = ("ms", "gain_margin_db", "phase_margin_deg")
    margins = {name: number(getattr(linear, name)[lane]) for name in names}
    return {"stable": bool(linear.stable[lane]), **margins}


def _step_row(steps: StepPart, lane: int, signal: Signal) -> dict[str, Any]:
    peak = steps.peak[lane]
    return {
        "settling_s": number(steps.settling[lane]),
        "overshoot_percent": number(steps.overshoot[lane]),
        "peak": None if peak is None else number(float(from_si(peak, signal.unit, signal.si))),
        "tripped": steps.tripped[lane],
    }


def _responses(linear: LinearPart) -> dict[str, Any]:
    """Gains [dB] and phases [deg]."""
    f = linear.curves[0][0]
    closed = np.full(len(f), np.nan, complex) if linear.closed is None else linear.closed
    shown = f >= _LOWEST
    gain, phase, seen = gain_db(closed), phase_deg(closed), shown & (f <= _HIGHEST)
    loops = [(gain_db(loop[f >= _LOWEST]), phase_deg(loop[f >= _LOWEST])) for f, loop in linear.curves]
    inside = [(gain > _LEAST) & (gain < _MOST) & (phase > _LAST) for gain, phase in loops]
    near = (np.concatenate([part[i][there] for part, there in zip(loops, inside, strict=True)]) for i in range(2))
    return {
        "f": packed(f[shown]),
        "gain": packed(gain[shown]),
        "phase": packed(phase[shown]),
        "axes": _bode_axes(gain[seen], phase[seen]),
        "open": [{"gain": packed(gain), "phase": packed(phase)} for gain, phase in loops],
        "open_axes": [_axis(next(near), (_LEAST, 24.0), 6.0), _axis(next(near), (-400.0, 0.0), 50.0)],
    }


def _bode_axes(gain: np.ndarray, phase: np.ndarray) -> list[Range]:
    return [_axis(np.clip(gain, _DEEPEST, _TOP), (-32.0, 12.0), 4.0), _axis(phase, (-370.0, 20.0), 90.0)]


def _axis(values: np.ndarray, usual: Range, step: float) -> Range:
    """The usual range, and as many whole steps more as the values need: it stays while numbers move a little."""
    values = values[np.isfinite(values)]
    low, high = values.min(initial=usual[0]), values.max(initial=usual[1])
    more = np.floor((low - usual[0]) / step), np.ceil((high - usual[1]) / step)
    return usual[0] + step * float(more[0]), usual[1] + step * float(more[1])


def _span(values: np.ndarray) -> tuple[Range, float]:
    """No range, and the step of an axis that has no usual one."""
    most = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    return (0.0, 0.0), 2.0 ** np.ceil(np.log2(most)) / 4 if most > 0 else 1.0


def drawn_rows(curves: np.ndarray, pixel: float) -> np.ndarray:
    """Rows [j] of evenly sampled curves [lanes, k] that show them to some pixels: many where one bends, and to larger
    pixels where that were too many."""
    rows = np.arange(curves.shape[1])
    while True:
        before = len(rows)
        left, middle, right = rows[:-2:2], rows[1:-1:2], rows[2::2]
        share = (middle - left) / (right - left)
        off = np.abs(curves[:, middle] - (1 - share) * curves[:, left] - share * curves[:, right])
        rows = np.delete(rows, 1 + 2 * np.flatnonzero(np.all(off <= pixel, axis=0)))
        if len(rows) > 0.95 * before:
            if len(rows) <= _POINTS:
                return rows
            pixel = 2 * pixel


def _courses(steps: StepPart, lanes: PlantLanes, task: LiveTask) -> dict[str, Any]:
    signal = task.signal
    reference, y, band = (
        np.asarray(from_si(value, signal.unit, signal.si)) for value in (steps.reference, steps.y, band_of(lanes, task))
    )
    band, end = float(band), float(reference[-1])
    drawn = np.concatenate((y.ravel(), reference, (end - band, end + band)))
    usual = ((min(-0.12 * end, 1.35 * end), max(-0.12 * end, 1.35 * end)), abs(end) / 4) if end else _span(drawn)
    axes = [_axis(drawn, *usual), _axis(steps.command, *_span(steps.command))]
    heights = _PIXEL * np.diff(axes).ravel()
    some, sent = drawn_rows(np.vstack((reference, y)), heights[0]), drawn_rows(steps.command, heights[1])
    return {
        "t": packed(steps.t[some]),
        "reference": packed(reference[some]),
        "y": packed(y[:, some]),
        "command_t": packed(steps.t[sent]),
        "command": packed(steps.command[:, sent]),
        "axes": axes,
        "turned": task.turned_words(lanes.rig, float(lanes.position[0])),
        "band": number(band),
        "arrives": number(task.scenario.arrives),
        "watched": number(float(steps.t[-1]) - (task.scenario.arrives or 0.0)),
        "end": number(end),
    }


def packed(values: np.ndarray) -> str:
    """Values [k] or [lanes, k], row after row; what is not finite is NaN."""
    return b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def number(value: float | None) -> float | None:
    """A number for JSON, None where there is none."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.6g}")
