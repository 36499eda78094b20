"""The report of what knowledge buys: settling over what is known, with the limit, and the designs that got it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from workbench.base.words import counted
from workbench.commands.common.judged import judged_words
from workbench.report import Curve, Figure, Mark, Page, Panel, Section, Table

from .config import KnowledgeConfig

_COLUMNS = {
    "controller": "controller",
    "known_percent": "known to +- [% of the range]",
    "settling_p99_s": "99 % settled [s]",
    "unused_p99_s": "99 % as tuned for the widest [s]",
    "settling_p50_s": "median [s]",
    "settling_worst_s": "slowest [s]",
    "times_limit": "99 % over the limit [1]",
    "overshoot_worst_percent": "worst overshoot [%]",
    "ms_worst": "worst Ms [1]",
    "unstable": "unstable",
    "tripped": "tripped",
    "hunting": "hunting",
    "missed": "goal missed",
}
Rows = Sequence[Mapping[str, Any]]


def knowledge_page(config: KnowledgeConfig, metrics: Mapping[str, Any]) -> Page:
    """The picture, one table, and the numbers of each design."""
    rows = metrics["rows"]
    note = (
        "Known to 50 %: each number anywhere in its range. Known to less: the range shrunk towards the rig's value. "
        "Every design is a search of its own, by the same goals, and is played on plants within that range that no "
        "search saw. As tuned for the widest: the same plants under the design for the widest range. The limit: the "
        "soonest that an optimiser settles the nominal rig, at mid stroke. "
        f"{judged_words(config.searches[0].start.conditions, config.rig)}"
    )
    heads, lines = list(_COLUMNS.values()), [[row[key] for key in _COLUMNS] for row in rows]
    best = [_COLUMNS["settling_p99_s"]]
    table = Table(f"On {counted(config.plants, 'plant')}", heads, lines, note, dict.fromkeys(best, "min"))
    sections = [
        Section("What knowledge buys", [knowledge_figure(metrics), table]),
        Section("The designs", [_numbers(name, part) for name, part in _by_controller(rows)]),
    ]
    return Page(f"What knowing {config.rig.name} is worth", _verdict(rows), sections, {"seed": str(config.seed)})


def knowledge_figure(metrics: Mapping[str, Any]) -> Figure:
    """Settling of 99 % over what is known: tuned for it as a line, tuned for the widest range as dots."""
    curves = []
    for name, rows in _by_controller(metrics["rows"]):
        known = np.array([row["known_percent"] for row in rows])
        curves.append(Curve(name, known, _numbers_of(rows, "settling_p99_s"), "points"))
        curves.append(Curve(f"{name}, as for {known[0]:g} %", known, _numbers_of(rows, "unused_p99_s"), "dot"))
    limit = metrics["limit_s"]
    marks = () if limit is None else (Mark(limit, f"the limit, {limit:.3g} s"),)
    top = 1.1 * np.nanmax([np.nanmax(curve.y) for curve in curves if np.isfinite(curve.y).any()] or [1.0])
    panel = Panel("99 % settled within [s]", curves, marks=marks, y_range=(0.0, float(top)))
    return Figure("What knowledge buys", "numbers known to +- [% of their ranges]", [panel], log_x=True)


def _numbers_of(rows: Rows, key: str) -> np.ndarray:
    return np.array([np.nan if row[key] is None else row[key] for row in rows])


def _by_controller(rows: Rows) -> Iterator[tuple[str, Rows]]:
    for name in dict.fromkeys(row["controller"] for row in rows):
        yield name, [row for row in rows if row["controller"] == name]


def _verdict(rows: Rows) -> str:
    """The soonest design for the widest and for the narrowest range."""
    said = []
    for percent in (max(row["known_percent"] for row in rows), min(row["known_percent"] for row in rows)):
        there = [row for row in rows if row["known_percent"] == percent and row["settling_p99_s"] is not None]
        if not there:
            said.append(f"known to {percent:g} % no controller settles on 99 %")
            continue
        best = min(there, key=lambda row: row["settling_p99_s"])
        said.append(f"known to {percent:g} % 99 % settle within {best['settling_p99_s']:.3g} s by {best['controller']}")
    text = "; ".join(dict.fromkeys(said))
    return f"{text[0].upper()}{text[1:]}."


def _numbers(name: str, rows: Rows) -> Table:
    heads = [f"{row['known_percent']:g} %" for row in rows]
    names = rows[0]["numbers"]
    lines = [[key, *(row["numbers"][key]["value"] for row in rows), entry["unit"]] for key, entry in names.items()]
    return Table(name, ["number", *heads, "unit"], lines)
