"""How often the lines of sheets hold the truth, some rigs a stage."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from workbench.base.errors import InputError
from workbench.commands.common.outcome import Outcome, Progress, Stage
from workbench.loop.drive_simulation import drive
from workbench.loop.standard_records import standard_set
from workbench.report import Curve, Figure, Page, Panel, Section, Table
from workbench.report.figures import Mark
from workbench.rigs.rig import Rig

from .drawn import Held
from .force import force_lines
from .valve import bench_lines, record_lines

TITLES = {
    "valve": "A valve on its test bench",
    "records": "The valve in records of a whole rig, steps, triangles and a multisine",
    "force": "A load cell",
}
_TOGETHER = 5  # rigs a stage
_KEYS = ("id", "value", "truth", "low", "high")
_NOTE = (
    "Held: intervals that hold the truth. Of 200 right intervals of 95 %, 190 hold it, 183 to 196 by chance. Typical "
    "half: the median half width. Bias and scatter: mean and standard deviation of what a line is off, over that half."
)


def run_sheet_study(rig: Rig, sheets: Sequence[str], number: int, stage: Stage, progress: Progress) -> Outcome:
    """`rows`: of each line how many rigs have it and how many hold its truth."""
    rows = []
    for sheet in sheets:
        lines = _lines(rig, sheet)
        held: list[dict[str, Any]] = []
        for first in range(0, number, _TOGETHER):
            numbers = range(first, min(first + _TOGETHER, number))
            held += stage(f"{sheet} {first}", partial(_held, lines, numbers))
            progress(f"{sheet}: {numbers[-1] + 1} of {number}")
        rows += [_row(sheet, id, own) for id, own in _by_id(held).items()]
    return Outcome({"rows": rows}, lambda: _page(rig, rows))


def _lines(rig: Rig, sheet: str) -> Callable[[int], list[Held]]:
    if sheet == "records":
        return partial(record_lines, rig, standard_set(drive(rig)))
    return partial(bench_lines if sheet == "valve" else force_lines, rig)


def _held(lines: Callable[[int], list[Held]], numbers: Sequence[int]) -> list[dict[str, Any]]:
    """Rows of each rig; none of one that cannot be played."""
    found = []
    for number in numbers:
        try:
            found += [{**{key: getattr(each, key) for key in _KEYS}, "holds": each.holds} for each in lines(number)]
        except InputError:
            continue
    return found


def _by_id(held: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Lines of a cell are named by force too, which differs from rig to rig: they are taken together by frequency."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for each in held:
        id = each["id"]
        if id.startswith(("dynamic", "compensated")):
            id = id.partition("hz")[0] + "hz"
        elif id.startswith("static"):
            id = "static_error"
        groups.setdefault(id, []).append(each)
    return groups


def _row(sheet: str, id: str, own: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    off = np.array([each["value"] - each["truth"] for each in own])
    half = float(np.median([(each["high"] - each["low"]) / 2 for each in own])) or np.nan
    return {
        "sheet": sheet,
        "id": id,
        "rigs": len(own),
        "held": sum(each["holds"] for each in own),
        "half": half,
        "bias": float(off.mean()) / half,
        "scatter": float(off.std()) / half,
    }


def _page(rig: Rig, rows: Sequence[Mapping[str, Any]]) -> tuple[Page, Figure]:
    figure = _figure(rows)
    sections = [Section("Lines", [figure])]
    for sheet in dict.fromkeys(row["sheet"] for row in rows):
        head = ["line", "intervals", "held", "held [%]", "typical half", "bias [half]", "scatter [half]"]
        own = [row for row in rows if row["sheet"] == sheet]
        cells = [
            [row["id"], row["rigs"], row["held"], _share(row), *(row[key] for key in ("half", "bias", "scatter"))]
            for row in own
        ]
        sections.append(Section(TITLES[sheet], [Table("", head, cells, _NOTE)]))
    total, held = (sum(row[key] for row in rows) for key in ("rigs", "held"))
    worst = min(rows, key=lambda row: row["held"] / row["rigs"])
    verdict = (
        f"{held} of {total} intervals of 95 % hold the truth; least often {worst['id']} of {worst['sheet']}, "
        f"{worst['held']} of {worst['rigs']}."
    )
    return Page(f"Sheets of rigs within the bounds of {rig.name}", verdict, sections), figure


def _share(row: Mapping[str, Any]) -> float:
    """Percent."""
    return 100 * row["held"] / row["rigs"]


def _figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    names = [f"{row['sheet']}: {row['id']}" for row in rows]
    curve = Curve("lines", np.arange(1, len(rows) + 1.0), np.array([_share(row) for row in rows]), "markers")
    panel = Panel("held [%]", [curve], marks=[Mark(95.0, "95 %")])
    return Figure("How often intervals hold the truth", "", [panel], x_names=names)
