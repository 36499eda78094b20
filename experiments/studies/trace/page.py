"""The report of a trace study: the rates beside their targets, who is taken for whom, and every wrong answer."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workbench.base.words import counted
from workbench.identify.trace.rule import NEIGHBOUR
from workbench.report import Curve, Figure, Page, Panel, Section, Table
from workbench.report.figures import Mark

from .score import FINE, HOW, VISIBLE, Row, TraceScore, odds


def page(rows: Sequence[Row], rates: Sequence[TraceScore], confusion: Mapping[str, Any], timing: Sequence[Any]) -> Page:
    """The page; `timing` has a row of CPU seconds for each campaign."""
    sections = [
        Section("Scores", [_scores(rates), picture(rows)]),
        Section("Truth and answer", [_confusion(confusion), *_neighbours(odds(rows))]),
        Section("Every answer that is not right", [_wrong(rows)]),
        Section("Every campaign", [_all(rows, timing)]),
    ]
    return Page("Trace study", _verdict(rows, rates), sections)


def picture(rows: Sequence[Row]) -> Figure:
    """Held-out chi2 after the trace over that before, by result."""
    finite = [row for row in rows if row.get("chi2_before") is not None and row.get("chi2_after") is not None]
    kinds = {"right": True, "not right": False}
    curves = []
    for name, fine in kinds.items():
        shown = [row for row in finite if (row["result"] in FINE) is fine]
        before, after = (np.array([row[key] for row in shown]) for key in ("chi2_before", "chi2_after"))
        curves.append(Curve(name, before, after, "markers"))
    marks = (Mark(1.0, "noise floor"), Mark(VISIBLE, "faint below", "x"))
    panel = Panel("held-out chi2 after [1]", curves, log_y=True, marks=marks)
    return Figure("What the traces leave", "held-out chi2 before [1]", [panel], log_x=True)


def _verdict(rows: Sequence[Row], rates: Sequence[TraceScore]) -> str:
    missed = [rate for rate in rates if rate.met is False]
    asked = sum(rate.met is not None for rate in rates)
    count = counted(len(rows), "campaign")
    if not missed:
        return f"{count}: all {asked} rates that have a target meet it."
    worst = "; ".join(f"{rate.label} {rate.value:.3g} ({rate.sense} {rate.target:.3g})" for rate in missed)
    return f"{count}: {asked - len(missed)} of {asked} rates that have a target meet it. Not met: {worst}."


def _scores(rates: Sequence[TraceScore]) -> Table:
    rows = [
        [
            rate.label,
            rate.value,
            rate.low,
            rate.high,
            f"{rate.sense} {rate.target:.3g}" if rate.sense else None,
            rate.met,
            rate.n,
        ]
        for rate in rates
    ]
    return Table(
        "Rates",
        ["rate", "value", "low", "high", "target", "met", "of"],
        rows,
        note=(
            "Low and high: exact 95 % binomial intervals (Clopper and Pearson), of the median by its order statistics. "
            "Campaigns with all sensors and good excitation are scored; faint ones, whose base fit leaves a held-out "
            f"chi2 below {VISIBLE:g}, count apart."
        ),
    )


def _confusion(confusion: Mapping[str, Any]) -> Table:
    rows = [
        [truth, *(count or None for count in counts)]
        for truth, counts in zip(confusion["truths"], confusion["counts"], strict=True)
    ]
    return Table(
        "Campaigns by truth and by what was said first",
        ["truth", *confusion["answers"]],
        rows,
        note="Answers without a name stand as none or unknown.",
    )


def _neighbours(odds: Sequence[Row]) -> list[Table]:
    if not odds:
        return []
    rows = [[row["effect"], row["campaigns"], *(row[how] for how in HOW), *_spread(row["leads"])] for row in odds]
    note = (
        "Lead: what the best neighbour leaves of the misfit beyond what the true effect leaves, over the latter. "
        f"Up to {NEIGHBOUR:g} the two tie; below zero the neighbour explains more."
    )
    title = "Effects with neighbours in their family"
    return [Table(title, ["effect", "campaigns", *HOW, "least lead", "median lead"], rows, note=note)]


def _spread(leads: Sequence[float]) -> list[float | None]:
    return [min(leads), float(np.median(leads))] if leads else [None, None]


def _wrong(rows: Sequence[Row]) -> Table:
    wrong = [row for row in rows if row["result"] not in FINE]
    return Table(
        "Wrong, missed, or undecided",
        ["campaign", "seed", "group", "truth", "formula", "verdict", "said", "equation", "first three", "chi2 before",
         "chi2 after", "result"],
        [
            [row["id"], row["seed"], row["group"], _listed(row["truth"]), _listed(row["formula"]), row.get("verdict"),
             row["error"] or _listed(row["named"]), row.get("said_equation"), _listed(row.get("ranked", [])),
             row.get("chi2_before"), row.get("chi2_after"), row["result"]]
            for row in wrong
        ],
        note="Under `items` metrics.json has the whole case, which draws the campaign again.",
    )  # fmt: skip


def _all(rows: Sequence[Row], timing: Sequence[Mapping[str, Any]]) -> Table:
    return Table(
        "Campaigns",
        ["campaign", "noise", "truth", "said", "result", "chi2 before", "chi2 after",
         "drawn in [CPU s]", "traced in [CPU s]"],
        [
            [row["id"], row["noise"], _listed(row["truth"]), row["error"] or _listed(row["named"]) or row["verdict"],
             row["result"], row.get("chi2_before"), row.get("chi2_after"), spent["draw_s"], spent["trace_s"]]
            for row, spent in zip(rows, timing, strict=True)
        ],
    )  # fmt: skip


def _listed(names: Sequence[str]) -> str:
    return " + ".join(names)
