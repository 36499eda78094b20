"""A load cell's sheet: read off a campaign's records, or off those that its rig plays."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...identify.acceptance.force_dynamic import ForcePoint
from ...identify.acceptance.force_static import StaticTest
from ...identify.acceptance.force_test import ForceSheet, Reference, force_sheet
from ...identify.acceptance.row import Row, judged
from ...records import Record
from ...report import Curve, Figure, Page, Panel, Section
from ...report.figures import Mark
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import Asked
from ..common.sheet_page import sheet_page
from .bench import ForceBench

_HOW = (
    "At rest in the manner of ISO 7500-1, in motion in the manner of ASTM E467 and ISO 4965-1. A sine has the size of "
    "its first harmonic in its middle. The force at the specimen is the reference cell's reading, or without one the "
    "indicated force less mass times acceleration. Compensation is judged with the mass that the other sines tell."
)
_PLAYED = (
    " Played by the engine on the rig file's model: a slow position loop holds levels, and sines are added to its "
    "command. The rig's cell has the noise and resolution that the file declares and no error of its own, the "
    "reference cell a third of that noise."
)


def run_force_test(sheet: Asked, asked: Reference, stage: Stage, progress: Progress) -> Outcome:
    """`rows` of the sheet; levels and sines as tables."""
    progress("records" if sheet.campaign else "levels and sines of force")
    found = force_sheet(_records(sheet), sheet.rig, asked)
    rows = judged(found.rows, {**found.limits, **sheet.limits})
    metrics = {"rows": [row.table() for row in rows]}
    return Outcome(
        metrics, lambda: force_page(sheet, found, rows, asked), _tables(found), subject=Subject(sheet.rig), dated=False
    )


def _records(sheet: Asked) -> Sequence[Record]:
    if sheet.campaign is None:
        return ForceBench(sheet.rig, sheet.seed).records()
    return (*sheet.campaign.train, *sheet.campaign.select, *sheet.campaign.heldout)


def _tables(found: ForceSheet) -> Mapping[str, Mapping[str, Any]]:
    tables = {}
    if found.static is not None:
        levels = found.static.levels
        tables["static"] = {
            "reference": np.array([level.reference for level in levels]),
            "indicated": np.array([level.indicated for level in levels]),
        }
    errors = [(point, error) for point in found.points if (error := point.error(found.mass)) is not None]
    if errors:
        tables["dynamic"] = {
            "f_hz": np.array([point.f for point, _ in errors]),
            "range": np.array([point.range for point, _ in errors]),
            "error": np.array([error.value for _, error in errors]),
            "deviation": np.array([error.deviation for _, error in errors]),
        }
    return tables


def force_page(sheet: Asked, found: ForceSheet, rows: Sequence[Row], asked: Reference) -> tuple[Page, Figure | None]:
    """The page and its telling figure, the errors over frequency."""
    dynamic = _dynamic(found, rows, asked)
    sections = [Section("Over frequency", [dynamic])] if dynamic is not None else []
    if found.static is not None:
        sections.append(Section("At rest", [_static(found.static)]))
    how = _HOW if sheet.campaign else _HOW + _PLAYED
    accuracy = f" The reference's own 95 % interval counts as {100 * asked.accuracy:g} % either way."
    page = sheet_page(f"Load-cell sheet: {sheet.name}", sheet.made, rows, sections, how + accuracy)
    return page, dynamic


def _dynamic(found: ForceSheet, rows: Sequence[Row], asked: Reference) -> Figure | None:
    by_id = {row.id: row for row in rows}
    curves = []
    for kind, name in (("dynamic_error", "indicated"), ("compensated_error", "less mass times acceleration")):
        own = [row for id, row in by_id.items() if id.startswith(kind) and row.value is not None]
        curves += _by_size(found.points, own, kind, name)
    if not curves:
        return None
    marks = [Mark(side * 100 * asked.within, f"{side * 100 * asked.within:g} %") for side in (1.0, -1.0)]
    return Figure("Error of the force range", "frequency [Hz]", [Panel("error [%]", curves, marks=marks)], log_x=True)


def _by_size(points: Sequence[ForcePoint], rows: Sequence[Row], kind: str, name: str) -> list[Curve]:
    """A curve of a kind of error for each record."""
    if len(rows) != len(points):
        return []
    records = list(dict.fromkeys(point.sine.record.name for point in points))
    curves = []
    for record in records:
        own = [(p.f, r) for p, r in zip(points, rows, strict=True) if p.sine.record.name == record]
        f, value, low, high = (
            np.array(column, float) for column in zip(*((f, r.value, r.low, r.high) for f, r in own), strict=True)
        )
        order = np.argsort(f)
        label = f"{name}, {record}" if len(records) > 1 else name
        curves.append(Curve(label, f[order], value[order], "points", band=(low[order], high[order])))
    return curves


def _static(test: StaticTest) -> Figure:
    curves = []
    for way, name in ((True, "way up"), (False, "way down")):
        levels = [level for group in test.repeats(way) for level in group]
        if levels:
            force, error = (
                np.array(column) for column in zip(*((each.reference, each.error) for each in levels), strict=True)
            )
            curves.append(Curve(name, force / 1e3, error, "markers"))
    return Figure("Indicated less true force at rest", "force [kN]", [Panel("error [N]", curves)])
