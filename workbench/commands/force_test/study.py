"""A load cell's sheet: read off a campaign's records, or off those that its rig plays."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...identify.acceptance.force_test import ForceSheet, Reference, force_sheet
from ...identify.acceptance.row import judged
from ...records import Record
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import Asked
from .bench import ForceBench
from .page import force_page


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
