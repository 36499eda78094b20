"""Recordings of a rig in simulation: its drive plays excitations, its sensors log them, a campaign folder is left."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.toml_text import toml_text
from ...loop.drive_simulation import DriveSimulation, drive, recorded
from ...loop.standard_records import standard_set
from ...records import Record
from ...records.campaign import ROLES
from ...records.excitation import Excitation, excitation, excitation_text
from ...records.frequency_sheet import table_text
from ...report import Figure, Page, Panel, Section, Table
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.limits_told import trip_marks
from ..common.outcome import Outcome, Progress, Stage
from ..common.time_figure import signal_panel
from .config import OWN, Plan

STATIC, REST = "static", 2.0  # s


def run_record(plan: Plan, stage: Stage, progress: Progress) -> Outcome:
    """Play and log every excitation; the last one is held out, `static` measures the noise, the others are train."""
    progress("excitations")
    ready = drive(plan.rig)
    played = {STATIC: _still(plan.rig)} | (_given(plan) or _standard(ready, stage))
    records, rows = [], []
    for number, (name, wave) in enumerate(played.items()):
        progress(f"{name}: {wave.t[-1]:.3g} s")
        stored = stage(f"record-{name}", partial(recorded, ready, wave, [plan.seed, number]))
        records.append(Record(name, wave.t, stored["signals"]))
        rows.append({"record": name, "role": role_of(name, list(played)), **stored["effort"]})
    metrics = {"rows": rows, "seed": plan.seed, "loop_gain": ready.loop.design.gain}
    files = _files(plan, rows, records, played)

    def draw() -> tuple[Page, Figure]:
        return _page(plan, ready, rows, records), recorded_figure(records[-1])

    return Outcome(metrics, draw, files=files, subject=Subject(plan.rig))


def _given(plan: Plan) -> dict[str, Excitation]:
    return {excitation.name: excitation for excitation in plan.files}


def _standard(ready: DriveSimulation, stage: Stage) -> dict[str, Excitation]:
    """The standard set, worked out once."""

    def compute() -> dict[str, dict[str, np.ndarray]]:
        return {n: {"reference": e.reference, "command": e.command} for n, e in standard_set(ready).items()}

    period = ready.rig.period.value
    return {name: Excitation(name, period, **columns) for name, columns in stage("excitations", compute).items()}


def _files(
    plan: Plan, rows: list[dict[str, Any]], records: Sequence[Record], played: Mapping[str, Excitation]
) -> dict[str, str]:
    """The campaign folder: campaign.toml, a file a record, what was played, and the rig where it is not bundled."""
    files = {"campaign.toml": campaign_text(plan.declared, plan.seed, rows)}
    files |= {f"{record.name}.csv": table_text({"t": record.t, **record.signals}) for record in records}
    files |= {f"played-{name}.csv": excitation_text(played[name]) for name in played if name != STATIC}
    if plan.declared == OWN:
        files[OWN] = rig_text(replace(plan.rig, effects=()))
    if plan.rig.effects:
        files["truth.toml"] = rig_text(plan.rig)
    return files


def campaign_text(declared: str, seed: int, rows: Sequence[Mapping[str, Any]], roles: Sequence[str] = ROLES) -> str:
    """The text of campaign.toml for a rig as it is declared, of rows with `record` and `role`."""
    records = {role: [f"{row['record']}.csv" for row in rows if row["role"] == role] for role in roles}
    return f"# simulated by `jackbench record`, seed {seed}\n{toml_text({'rig': declared, 'records': records})}"


def _still(rig: Rig) -> Excitation:
    return excitation(STATIC, "command", np.zeros(round(REST / rig.period.value)), rig.period.value, rig["xmid"])


def role_of(name: str, names: Sequence[str]) -> str:
    """The role of one of the records in the order in which they are played."""
    if name == STATIC:
        return STATIC
    return "heldout" if name == names[-1] else "train"


def _page(plan: Plan, drive: DriveSimulation, rows: list[dict[str, Any]], records: Sequence[Record]) -> Page:
    table = Table(
        "What was recorded",
        ["record", "role", "duration [s]", "position within [mm]", "speed [m/s]", "command [1]", "lowest [bar]",
         "limited [s]"],
        [list(row.values()) for row in rows],
        note="Lowest of all chamber pressures. Limited: the guard changed the command.",
    )  # fmt: skip
    how = (
        f"The drive holds the jack by a position loop of {drive.loop.design.gain:g} 1/m and adds the played command to "
        "it. Row k of a record is what the sensors say at t_k right after command k was written, with the noise and "
        "the resolution of the rig file. The played-*.csv files are what a drive plays to record the same on a rig."
    )
    notes = [how]
    if plan.rig.effects:
        names = ", ".join(use.name for use in plan.rig.effects)
        notes.append(
            f"Recorded with {names}. rig.toml, which campaign.toml names, is without; truth.toml is as simulated."
        )
    sections = [
        Section("Records", [table, *notes]),
        Section("Signals", [recorded_figure(record) for record in records]),
    ]
    return records_page(plan.rig.name, plan.seed, rows, sections)


def records_page(name: str, seed: int, rows: Sequence[Mapping[str, Any]], sections: Sequence[Section]) -> Page:
    """The page of simulated records of a rig or platform."""
    verdict = f"{len(rows)} simulated records of {name}, seed {seed}; {rows[-1]['record']} is held out."
    return Page(f"Recordings of {name}", verdict, sections)


def recorded_figure(record: Record, mark: float | None = None) -> Figure:
    """All signals of a record, and when [s] it tripped, if it did."""
    others = [name for name in record.names if name not in ("reference", "position", "command")]

    def panel(*names: str) -> Panel:
        courses = {name: (record.t, record.signals[name]) for name in names if name in record.names}
        return signal_panel(SIGNALS[names[-1]], courses, marks=trip_marks(mark))

    panels = [panel("reference", "position"), panel("command"), *(panel(name) for name in others)]
    return Figure(record.name, "time [s]", panels)
