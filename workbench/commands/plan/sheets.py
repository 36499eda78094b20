"""What a sheet that is to be signed still misses: the records that tell its open lines, as files to play."""

from collections.abc import Mapping, Sequence
from typing import Any

from ...base.words import counted
from ...identify.acceptance.excitations import FORCE_TELLS, VALVE_TELLS, missing_records
from ...identify.acceptance.force_test import Reference, force_sheet
from ...identify.acceptance.row import Row
from ...identify.acceptance.valve_test import valve_sheet
from ...records import Campaign
from ...records.excitation import excitation_text
from ...report import Figure, Page, Section, Table
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..excite.config import VALVE_TEST
from ..excite.sets import sheet_excitations

_WITHIN = 0.01  # of a force range; which lines are open does not depend on it
_PLAY = {
    VALVE_TEST: "Play the files with the valve on its bench; block the load ports for valve-pressure.",
    "force-test": (
        "Play the files with the specimen in: jackbench record RIG --at ADDRESS --play FILES. force-free is any record "
        "that moves without a specimen, with force and acceleration; a reference cell in force-sine serves as well."
    ),
}


def run_sheet_plan(kind: str, campaign: Campaign, rig: Rig, stage: Stage, progress: Progress) -> Outcome:
    """`missing`: records with the lines that each tells; `beyond`: open lines that none of them tells. Raises
    InputError for a rig that has no such sheet, and for records that the sheet refuses."""
    waves = {wave.name: wave for wave in sheet_excitations(kind, rig)}
    progress("the sheet as far as the records tell it")
    rows = _rows(kind, campaign, rig)
    told = missing_records(rows, VALVE_TELLS if kind == VALVE_TEST else FORCE_TELLS)
    lacking = [
        {"record": record, "lines": lines, "file": f"{record}.csv" if record in waves else None,
         "seconds": float(waves[record].t[-1]) if record in waves else None}
        for record, lines in told.items()
    ]  # fmt: skip
    tellable = {line for lines in told.values() for line in lines}
    beyond = [{"id": r.id, "reason": r.reason} for r in rows if r.value is None and r.id not in tellable]
    said = sum(row.value is not None for row in rows)
    metrics = {"sheet": kind, "said": said, "lines": len(rows), "missing": lacking, "beyond": beyond}
    files = {f"{record}.csv": excitation_text(waves[record]) for record in told if record in waves}
    return Outcome(metrics, lambda: _page(campaign, metrics), files=files, subject=Subject(rig))


def _rows(kind: str, campaign: Campaign, rig: Rig) -> Sequence[Row]:
    records = (*campaign.train, *campaign.select, *campaign.heldout)
    if kind == VALVE_TEST:
        return valve_sheet(records, rig).rows
    return force_sheet(records, rig, Reference(0.0, _WITHIN)).rows


def _page(campaign: Campaign, metrics: Mapping[str, Any]) -> tuple[Page, Figure | None]:
    lacking, beyond, kind = metrics["missing"], metrics["beyond"], metrics["sheet"]
    rows = [[each["record"], each["seconds"], ", ".join(each["lines"])] for each in lacking]
    table = Table("Record, and the open lines that it tells", ["record", "duration [s]", "lines"], rows)
    sections = [Section("What to record", [table, _PLAY[kind]])] if lacking else []
    if beyond:
        cells = [[each["id"], each["reason"]] for each in beyond]
        sections.append(Section("What none of these records tells", [Table("", ["line", "why it is open"], cells)]))
    title = f"{campaign.path.resolve().name}: what a sheet of {kind} misses"
    return Page(title, _verdict(metrics), sections), None


def _verdict(metrics: Mapping[str, Any]) -> str:
    names = [each["record"] for each in metrics["missing"]]
    open_lines, beyond = metrics["lines"] - metrics["said"], len(metrics["beyond"])
    told = f"The records tell {metrics['said']} of {metrics['lines']} lines of the sheet."
    if not names:
        return f"{told} No record of this test is missing."
    more = f" No record of this test tells the other {beyond}." if beyond else ""
    what = f"{counted(len(names), 'record')} would tell {open_lines - beyond} more"
    return f"{told} {what[0].upper()}{what[1:]}: {', '.join(names)}.{more}"
