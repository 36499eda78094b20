"""Figures over time: signals with their references, command and pressures, and the share that has settled."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.signals import SIGNALS, Signal
from ...base.units import from_si
from ...loop.scenarios import Scenario
from ...records import Record
from ...report import Curve, Figure, Mark, Panel, Style

if TYPE_CHECKING:
    from ...loop.sampled_loop import LoopRun

Columns = Mapping[str, np.ndarray]
TIME = "t [s]"

_SHORTEST = 0.1  # s
_TIMES = 3.0  # what the quickest controller needs: a longer window would hide all but the slowest
_BEFORE = 0.1  # of the window lies before a load
_CYCLES = 4  # of a sine, the last ones: by then it repeats


def _window(scenario: Scenario, settling_s: Sequence[float | None]) -> tuple[float, float] | None:
    """What is shown of a run at first [s], by the settling times of its loops; None where that is all of it.

    Until three times what the quickest needs, from just before a load or far end that alone disturbs; the last cycles
    of a sine.
    """
    whole, arrives = scenario.duration, scenario.arrives
    if scenario.frequency:
        shown = max(0.0, whole - _CYCLES / scenario.frequency), whole
    elif arrives is None:
        return None
    else:
        quickest = min((value for value in settling_s if value is not None), default=whole)
        last = min(whole, arrives + max(_SHORTEST, _TIMES * quickest))
        begins = scenario.load_at if scenario.load and not scenario.size else 0.0
        shown = max(0.0, begins - _BEFORE * (last - begins)), last
    return None if shown == (0.0, whole) else shown


def _window_words(shown: tuple[float, float] | None, scenario: Scenario) -> str:
    """What the note of a figure says of its window."""
    if shown is None:
        return ""
    first, last = shown
    words = f"to {last:.2g} s" if first == 0 else f"from {first:.2g} to {last:.3g} s"
    return f"Shown {words} of {scenario.duration:g} s; a double click shows all of it."


def signal_panel(
    signal: Signal, courses: Mapping[str, tuple[np.ndarray, np.ndarray]], label: str = "", marks: Sequence[Mark] = ()
) -> Panel:
    """Courses (times [n] s, values [n] SI) of a signal by name, in the unit that people read; what is called reference
    is dotted. `label` is one without a unit, else the signal's own name."""
    curves = []
    for name, (t, values) in courses.items():
        style: Style = "dot" if name == "reference" else "line"
        curves.append(Curve(name, t, from_si(values, signal.unit, signal.si), style))
    return Panel(f"{label} [{signal.unit}]" if label else signal.label, curves, marks=marks)


def time_figure(
    title: str,
    signal: Signal,
    runs: "Mapping[str, Columns | Record | LoopRun]",
    others: Sequence[str],
    scenario: Scenario | None = None,
    rows: Sequence[Mapping[str, Any]] = (),
    marks: Sequence[Mark] = (),
) -> Figure:
    """The controlled `signal` beside the first run's reference, then a panel for each of `others` that there is.

    `runs` by name, as records or as columns: see run_columns. Of a `scenario` as much is shown at first as `rows` of
    its metrics tell. `marks` are those of every panel.
    """
    columns = {name: run_columns(run) for name, run in runs.items()}
    first = next(iter(columns.values()))
    reference = {"reference": (first[TIME], first["reference"])} if "reference" in first else {}

    def courses(name: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        return {label: (run[TIME], run[name]) for label, run in columns.items() if name in run}

    panels = [signal_panel(signal, reference | courses(signal.name), marks=marks)]
    panels += [signal_panel(SIGNALS[name], courses(name), marks=marks) for name in others if name in first]
    if scenario is None:
        return Figure(title, "time [s]", panels)
    shown = _window(scenario, [row.get("settling_s") for row in rows if row.get("scenario") == scenario.name])
    return Figure(title, "time [s]", panels, note=_window_words(shown, scenario), x_range=shown)


def run_columns(run: "Columns | Record | LoopRun") -> Columns:
    """A run or record as columns [n] by signal, SI, and the time."""
    if isinstance(run, Mapping):
        return run
    record = run if isinstance(run, Record) else run.record
    return {TIME: record.t, **record.signals}


def share_figure(title: str, times: Mapping[str, np.ndarray], x_label: str, y_label: str) -> Figure:
    """Up to which time which share [%] has come there, of times [n] by name in the unit of `x_label`; NaN of what never
    does."""
    curves = []
    for name, each in times.items():
        at, count = np.unique(each[~np.isnan(each)], return_counts=True)
        curves.append(Curve(name, at, 100 * np.cumsum(count) / max(1, len(each))))
    return Figure(title, x_label, (Panel(y_label, curves),))
