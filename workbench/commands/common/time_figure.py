"""Runs of loops over time: the controlled signal with its reference, the command, and further signals."""

from collections.abc import Mapping, Sequence

from ...base.signals import SIGNALS, Signal
from ...base.units import from_si
from ...records import Record
from ...report import Curve, Figure, Panel


def time_figure(title: str, signal: Signal, records: Mapping[str, Record], others: Sequence[str]) -> Figure:
    """The controlled `signal` beside the first record's reference, then a panel for each of `others` that there is."""
    first = next(iter(records.values()))

    def curves(shown: Signal) -> list[Curve]:
        return [Curve(name, r.t, from_si(r.signals[shown.name], shown.unit, shown.si)) for name, r in records.items()]

    reference = Curve("reference", first.t, from_si(first.signals["reference"], signal.unit, signal.si), "dot")
    panels = [Panel(SIGNALS[name].label, curves(SIGNALS[name])) for name in others if name in first.signals]
    return Figure(title, "time [s]", [Panel(signal.label, [reference, *curves(signal)]), *panels])
