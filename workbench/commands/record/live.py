"""Recordings of a live rig: its drive plays excitations, a slow position loop holds it, a campaign folder is left."""

from typing import Any

import numpy as np

from ...base.errors import InputError, LinkLost
from ...base.words import counted
from ...link.client import LinkClient
from ...link.commissioning.allowed import allowed, safe
from ...link.course import PlayedCourse, play_course, rest_record, wire_rig
from ...link.joined import joined
from ...link.trips import Trip
from ...link.wire_loop import INTERRUPTED, check
from ...loop.drive_simulation import DriveSimulation, drive
from ...loop.standard_records import standard_set
from ...records import Record
from ...records.excitation import Excitation, excitation_text
from ...report import Figure, Page, Section, Table
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.limits_told import limits_json, limits_section
from ..common.outcome import Outcome, Progress, Stage
from ..common.wire_campaign import wire_campaign
from .config import Plan
from .study import recorded_figure


def run_live(plan: Plan, at: str, token: str, stage: Stage, progress: Progress) -> Outcome:
    """Play every excitation on the rig at `at`, as long as none is cut short. `rows` of what was recorded; `late`
    readings; `ended`: why it stopped, or None; `trips`; `limits`, and whose each is. Raises InputError for an
    excitation that the rig cannot play, before anything moves."""
    records, late, ended, trips, mark = dict[str, Record](), 0, None, list[Trip](), None
    with LinkClient(at, token) as client:
        rig = joined(plan.rig, client.hello)
        progress("excitations")
        ready = drive(wire_rig(rig, client))
        waves = _waves(plan, ready)
        check(client, rig, ready.loop.build(rig.period.value))
        static = rest_record(client, rig)
        for wave in waves:
            progress(f"{wave.name}: {wave.t[-1]:.3g} s")
            try:
                played = _played(client, rig, ready.loop.build(wave.period), wave)
            except (LinkLost, KeyboardInterrupt) as error:
                ended = str(error) or INTERRUPTED
                break
            records[wave.name], late, ended = played.record, late + played.run.late, played.ended
            trips, mark = [*trips, *([played.trip] if played.trip else [])], played.mark
            if ended is not None:
                break
        name = client.hello.rig
    rows = [_row(name, record, rig, list(records)) for name, record in records.items()]
    metrics: dict[str, Any] = {"rig": name, "rows": rows, "late": late, "ended": ended, "trips": len(trips)}
    metrics |= {"tripped": [trip.table() for trip in trips], "limits": limits_json(rig)}
    files = wire_campaign(rig, client, static, records, list(records)[-1:])
    files |= {f"played-{wave.name}.csv": excitation_text(wave) for wave in waves}

    def draw() -> tuple[Page, Figure]:
        shown = records or {"static": static}
        figures = [recorded_figure(record) for record in list(shown.values())[:-1]]
        figures.append(recorded_figure(list(shown.values())[-1], mark))
        return _page(metrics, rig, figures), figures[-1]

    return Outcome(metrics, draw, files=files, subject=Subject(rig))


def _waves(plan: Plan, ready: DriveSimulation) -> list[Excitation]:
    """What is played: the files, or the standard set as large as it stays clear of the limits on every plant within the
    rig's bounds. Raises InputError for a file that does not."""
    rig = ready.rig
    if plan.files and rig.period != plan.rig.period:
        hz, its = 1 / plan.rig.period.value, 1 / rig.period.value
        raise InputError(f"--play: {rig.name} runs at {its:g} Hz, its file says {hz:g} Hz; set its [control] period")
    plants = allowed(rig)
    for wave in plan.files:
        if reason := plants.trouble_with(ready.loop, wave):
            raise InputError(f"{wave.name}: on {rig.name} in simulation, {reason}; make it smaller")
    return list(plan.files) or safe(plants, ready.loop, list(standard_set(ready).values()))


def _played(client: LinkClient, rig: Rig, controller: Any, wave: Excitation) -> PlayedCourse:
    start = float(wave.reference[0])
    return play_course(client, rig, controller, wave.reference - start, start, wave.command, name=wave.name)


def _row(name: str, record: Record, rig: Rig, names: list[str]) -> dict[str, Any]:
    signals = record.signals
    return {
        "record": name,
        "role": "heldout" if name == names[-1] else "train",
        "seconds": float(record.t[-1]) if len(record.t) else 0.0,
        "peak_position_mm": float(np.abs(signals["position"] - rig.middle).max(initial=0.0) * 1e3),
        "peak_command": float(np.abs(signals["command"]).max(initial=0.0)),
    }


def _page(metrics: dict[str, Any], rig: Rig, figures: list[Figure]) -> Page:
    rows = metrics["rows"]
    verdict = f"{counted(len(rows), 'record')} of {metrics['rig']}"
    verdict += f"; {rows[-1]['record']} is held out." if rows else "."
    if metrics["late"]:
        verdict += f" {metrics['late']} readings were lost or late."
    if metrics["ended"]:
        verdict += f" Playing was cut short: {metrics['ended']}."
    heads = ["record", "role", "duration [s]", "position within [mm]", "command [1]"]
    note = "The rig was held by a slow position loop, to whose command the played one was added. rig.toml is the "
    note += "declared rig with the limits below; campaign.toml says how late its commands act behind the link."
    table = Table("What was recorded", heads, [list(row.values()) for row in rows], note)
    sections = [Section("Records", [table]), Section("Signals", figures), limits_section(rig)]
    return Page(f"Recordings of {metrics['rig']}", verdict, sections)
