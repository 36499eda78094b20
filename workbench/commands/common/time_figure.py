"""Runs of loops over time: the controlled signal with its reference, the command, and further signals."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...base.signals import SIGNALS, Signal
from ...base.units import from_si
from ...loop.scenarios import Scenario
from ...records import Record
from ...report import Curve, Figure, Mark, Panel

Columns = Mapping[str, np.ndarray]
TIME = "t [s]"

_SHORTEST = 0.1  # s
_TIMES = 3.0  # what the quickest controller needs: a longer window would hide all but the slowest
_BEFORE = 0.1  # of the window lies before a load
_CYCLES = 4  # of a sine, the last ones: by then it repeats


def window(scenario: Scenario, settling_s: Sequence[float | None]) -> tuple[float, float] | None:
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


def window_words(shown: tuple[float, float] | None, scenario: Scenario) -> str:
    """What the note of a figure says of its window."""
    if shown is None:
        return ""
    first, last = shown
    words = f"to {last:.2g} s" if first == 0 else f"from {first:.2g} to {last:.3g} s"
    return f"Shown {words} of {scenario.duration:g} s; a double click shows all of it."


def time_figure(
    title: str,
    signal: Signal,
    runs: Mapping[str, Columns],
    others: Sequence[str],
    shown: tuple[float, float] | None = None,
    note: str = "",
    marks: Sequence[Mark] = (),
) -> Figure:
    """The controlled `signal` beside the first run's reference, then a panel for each of `others` that there is.

    `runs` by name: see run_columns. `shown`: see window. `marks` are those of every panel.
    """
    first = next(iter(runs.values()))

    def curves(of: Signal) -> list[Curve]:
        return [Curve(name, run[TIME], from_si(run[of.name], of.unit, of.si)) for name, run in runs.items()]

    reference = Curve("reference", first[TIME], from_si(first["reference"], signal.unit, signal.si), "dot")
    panels = [Panel(SIGNALS[name].label, curves(SIGNALS[name]), marks=marks) for name in others if name in first]
    controlled = Panel(signal.label, [reference, *curves(signal)], marks=marks)
    return Figure(title, "time [s]", [controlled, *panels], note=note, x_range=shown)


def run_columns(record: Record) -> Columns:
    """A record as columns [n] by signal, SI, and the time."""
    return {TIME: record.t, **record.signals}
