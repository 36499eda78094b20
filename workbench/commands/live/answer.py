"""What a view shows, in the units that people are shown, as the page's script reads it."""

from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.signals import Signal
from ...base.units import from_si
from ...loop.plant_lanes import PlantLanes
from .after import AfterPart
from .packed import number, packed
from .view import LinearPart, StepPart, Task, band_of, missed_goals, missed_words

_LOWEST = 0.1  # Hz, of what is shown
_FIRST, _EVEN = 250, 150  # points of a curve over time: its first samples, and over all of it
_LEAST, _MOST, _LAST = -40.0, 30.0, -450.0  # dB and deg: what is drawn of an open loop


def view_answer(lanes: PlantLanes, linear: LinearPart | None, steps: StepPart | None, task: Task) -> dict[str, Any]:
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
        "linear": None if linear is None else _responses(linear),
        "steps": None if steps is None else _courses(steps, lanes, task),
    }


def after_answer(part: AfterPart, signal: Signal) -> dict[str, Any]:
    """The closed loop by sines, and which rigs hunt: None where that was not looked at."""
    sines = part.sines
    shown = sines and {
        "f": packed(sines.f),
        "gain": packed(gain_db(sines.response[signal.name])),
        "phase": packed(phase_deg(sines.response[signal.name])),
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
    return {
        "f": packed(f[shown]),
        "gain": packed(gain_db(closed[shown])),
        "phase": packed(phase_deg(closed[shown])),
        "open": [_open_loop(loop[f >= _LOWEST]) for f, loop in linear.curves],
    }


def _open_loop(loop: np.ndarray) -> dict[str, str]:
    """What a Nichols chart shows of it: below and beyond are the loop's last points."""
    gain, phase = gain_db(loop), phase_deg(loop)
    inside = (gain > _LEAST) & (gain < _MOST) & (phase > _LAST)
    drawn = inside | np.append(inside[1:], False) | np.insert(inside[:-1], 0, False)
    return {"gain": packed(gain[drawn]), "phase": packed(phase[drawn])}


def _courses(steps: StepPart, lanes: PlantLanes, task: Task) -> dict[str, Any]:
    k = len(steps.t)
    some = np.union1d(np.arange(min(k, _FIRST)), np.linspace(0, k - 1, _EVEN).round().astype(int))
    signal = task.signal
    reference, y, band = (
        np.asarray(from_si(value, signal.unit, signal.si)) for value in (steps.reference, steps.y, band_of(lanes, task))
    )
    return {
        "t": packed(steps.t[some]),
        "reference": packed(reference[some]),
        "y": packed(y[:, some]),
        "command": packed(steps.command[:, some]),
        "band": number(float(band)),
        "arrives": number(task.scenario.arrives),
        "watched": number(float(steps.t[-1]) - (task.scenario.arrives or 0.0)),
        "end": number(float(reference[-1])),
    }
