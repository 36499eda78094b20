"""Recordings of a live rig: its drive plays excitations, a slow position loop holds it, a campaign folder is left."""

from typing import Any

import numpy as np

from ...base.errors import InputError, LinkLost
from ...base.words import counted
from ...link.client import LinkClient
from ...link.course import Played, play_course, rest_record
from ...link.wire_loop import INTERRUPTED
from ...loop.drive_simulation import drive, trouble
from ...loop.drive_simulation import play as simulated
from ...loop.standard_records import standard_set
from ...records import Record
from ...records.excitation import Excitation, excitation_text
from ...report import Figure, Page, Section, Table
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.wire_campaign import wire_campaign
from .config import Plan
from .study import recorded_figure


def run_live(plan: Plan, at: str, token: str, stage: Stage, progress: Progress) -> Outcome:
    """Play every excitation on the rig at `at`, as long as none is cut short. `rows` of what was recorded; `late`
    readings; `ended`: why it stopped, or None. Raises InputError for an excitation that the declared rig cannot play,
    before anything moves."""
    progress("excitations")
    ready = drive(plan.rig)
    waves = list(plan.files) or list(standard_set(ready).values())
    for wave in waves:
        if reason := trouble(simulated(ready, wave)):
            raise InputError(f"{wave.name}: on {plan.rig.name} in simulation, {reason}; make it smaller")
    records, late, ended = dict[str, Record](), 0, None
    with LinkClient(at, token) as client:
        static = rest_record(client)
        for wave in waves:
            progress(f"{wave.name}: {wave.t[-1]:.3g} s")
            try:
                played = _played(client, plan.rig, ready.loop.build(wave.period), wave)
            except (LinkLost, KeyboardInterrupt) as error:
                ended = str(error) or INTERRUPTED
                break
            records[wave.name], late, ended = played.record, late + played.run.late, played.ended
            if ended is not None:
                break
        name = client.hello.rig
    rows = [_row(name, record, plan.rig, list(records)) for name, record in records.items()]
    metrics: dict[str, Any] = {"rig": name, "rows": rows, "late": late, "ended": ended}
    files = wire_campaign(plan.rig, client, static, records, list(records)[-1:])
    files |= {f"played-{wave.name}.csv": excitation_text(wave) for wave in waves}

    def draw() -> tuple[Page, Figure]:
        shown = records or {"static": static}
        return _page(metrics, shown), recorded_figure(list(shown.values())[-1])

    return Outcome(metrics, draw, files=files, subject=Subject(plan.rig))


def _played(client: LinkClient, rig: Rig, controller: Any, wave: Excitation) -> Played:
    start = float(wave.reference[0])
    return play_course(client, rig, controller, wave.reference - start, start, wave.command)


def _row(name: str, record: Record, rig: Rig, names: list[str]) -> dict[str, Any]:
    signals = record.signals
    return {
        "record": name,
        "role": "heldout" if name == names[-1] else "train",
        "seconds": float(record.t[-1]) if len(record.t) else 0.0,
        "peak_position_mm": float(np.abs(signals["position"] - rig.middle).max(initial=0.0) * 1e3),
        "peak_command": float(np.abs(signals["command"]).max(initial=0.0)),
    }


def _page(metrics: dict[str, Any], records: dict[str, Record]) -> Page:
    rows = metrics["rows"]
    verdict = f"{counted(len(rows), 'record')} of {metrics['rig']}"
    verdict += f"; {rows[-1]['record']} is held out." if rows else "."
    if metrics["late"]:
        verdict += f" {metrics['late']} readings were lost or late."
    if metrics["ended"]:
        verdict += f" Playing was cut short: {metrics['ended']}."
    heads = ["record", "role", "duration [s]", "position within [mm]", "command [1]"]
    note = "The rig was held by a slow position loop, to whose command the played one was added. rig.toml is the "
    note += "declared rig; campaign.toml says how late its commands act behind the link."
    table = Table("What was recorded", heads, [list(row.values()) for row in rows], note)
    figures = [recorded_figure(record) for record in records.values()]
    return Page(f"Recordings of {metrics['rig']}", verdict, [Section("Records", [table]), Section("Signals", figures)])
