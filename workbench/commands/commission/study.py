"""The whole way from a datasheet to a verified controller, on a live rig."""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.toml_text import toml_text
from ...control.controller_spec import ControllerSpec
from ...control.export import coefficients
from ...control.export.c_code import c_code
from ...link.client import LinkClient
from ...link.course import play_course, rest_record
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.run_folder import Run
from ..common.wire_campaign import wire_campaign, wire_rig
from ..excite.study import drive
from ..trace.study import trace_campaign
from .automatic import automatic
from .designs import experiment_of, searched_design
from .looks import SmallMoves, check_rest, pulses, small_moves
from .motions import safe_records
from .page import commission_page
from .verify import SINE, STEPS, played_ways, table_row


@dataclass(frozen=True)
class Wanted:
    """What is commissioned: the datasheet's rig at an address, within `seconds` of its time, for the sake of `goal`."""

    rig: Rig
    at: str
    token: str
    seconds: float
    goal: str
    jobs: int


def run_commission(wanted: Wanted, run: Run, progress: Progress) -> Outcome:
    """commission.json: `verdict` and `effects` of the trace, `rows` of every way in every scenario, `rig_seconds`,
    `computing_seconds`, `trips`, what was `played`, and the `controller`'s file."""
    began, played = time.process_time(), list[dict[str, Any]]()
    rig, clock = wanted.rig, _Clock(wanted.seconds)
    with LinkClient(wanted.at, wanted.token) as client:
        progress("looks at the rig at rest: noise, dead or impossible readings")
        rest = rest_record(client)
        check_rest(rig, rest)
        clock.spend("static", "rest", rest.t[-1], played)
        progress("moves it by a millimetre: directions, speed, the mode of its oil")
        moves = _small(client, rig, clock, played)
        progress("designs records that every plant within the bounds takes")
        ready, waves = safe_records(rig)
        records = {}
        for wave in waves:
            progress(f"plays {wave.name} on the rig, {wave.t[-1]:.3g} s")
            loop, start = ready.loop.build(wave.period), float(wave.reference[0])
            done = play_course(client, rig, loop, wave.reference - start, start, wave.command)
            records[wave.name] = done.record
            clock.spend(wave.name, "excitation", done.seconds, played)
            if done.ended is not None:
                progress(f"{wave.name} was cut short: {done.ended}")
                break
        declared = wire_rig(rig, client)
        folder = run.dir / "campaign"
        folder.mkdir(exist_ok=True)
        for name, text in wire_campaign(declared, rest, records, list(records)[-1:]).items():
            (folder / name).write_text(text, encoding="utf-8")
        progress("asks what the records say that the datasheet does not")
        answer = trace_campaign(folder, stage=run.stage, progress=progress, jobs=wanted.jobs)
        progress(answer.sentence)
        found = _without_link_delay(answer.rig, rig)
        ways = _ways(wanted, moves, rig, found, run, progress)
        judged, seconds, ended = played_ways(client, rig, ways, (*STEPS, SINE), progress)
        clock.spend("verification", "verify", seconds, played)
    rows = [table_row(each) for each in judged]
    best = ways["found"][0]
    metrics = {
        "verdict": answer.verdict,
        "effects": list(answer.effects),
        "rows": rows,
        "rig_seconds": clock.spent,
        "trips": sum("tripped" in str(each.row["tripped"]) for each in judged),
        "ended": ended,
        "played": played,
        "controller": "controller.toml",
        "timing": {"computing_seconds": time.process_time() - began},
    }
    files = _files(best, rig, found, metrics)
    subject = Subject(found, [spec for spec, _ in ways.values()])
    return Outcome(metrics, lambda: commission_page(wanted.goal, metrics, judged, answer), {}, files, subject)


class _Clock:
    """The rig's seconds."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self.spent = seconds, 0.0

    def spend(self, what: str, why: str, seconds: float, played: list[dict[str, Any]]) -> None:
        """Note what was played."""
        self.spent += float(seconds)
        played.append({"record": what, "for": why, "seconds": float(seconds)})


def _small(client: LinkClient, rig: Rig, clock: _Clock, played: list[dict[str, Any]]) -> SmallMoves:
    wave, size = pulses(rig)
    done = play_course(client, rig, drive(rig).loop.build(rig.period.value), np.zeros(len(wave)), rig.middle, wave)
    clock.spend("small moves", "looks", done.seconds, played)
    return small_moves(rig, done.run.record, size)


def _ways(
    wanted: Wanted, moves: SmallMoves, rig: Rig, found: Rig, run: Run, progress: Progress
) -> Mapping[str, tuple[ControllerSpec, Rig]]:
    """A controller by rules, one for the datasheet, one for the rig as found; each with the rig that predicts it."""
    plain_law = automatic(rig, moves)
    designs = {}
    for name, model in (("datasheet", rig), ("found", found)):
        progress(f"searches a controller for the rig as the {name} has it" if name == "datasheet" else
                 "searches a controller for the rig as it was found")  # fmt: skip

        stage = _named_stage(run, name)
        spec, missed = searched_design(model, plain_law, name, wanted.goal, stage, _few(progress), wanted.jobs)
        if missed:
            progress(f"no design meets every goal on the {name} rig: {missed}")
        designs[name] = spec, model
    return {"automatic": (plain_law, rig), **designs}


def _named_stage(run: Run, name: str) -> Stage:
    """Stages of one of several searches."""
    return lambda key, compute: run.stage(f"{name}-{key}", compute)


def _few(progress: Progress) -> Progress:
    """Of a search, every fiftieth trial."""
    return lambda text: (
        progress(text) if not text.startswith("trial ") or text.split()[1].endswith(("00", "50")) else None
    )


def _without_link_delay(found: Rig, declared: Rig) -> Rig:
    """The rig as found without the delay that the link adds, which every loop there has added anew."""
    own = {use.name: use for use in declared.effects}
    effects = [own.get(use.name) if use.name == "drive.delay" else use for use in found.effects]
    return replace(found, name=f"{declared.name}-found", effects=tuple(use for use in effects if use is not None))


def _files(spec: ControllerSpec, rig: Rig, found: Rig, metrics: Mapping[str, Any]) -> dict[str, str]:
    law = coefficients(spec.build(rig.period.value), rig.period.value)
    whole = {**metrics, "computing_seconds": metrics["timing"]["computing_seconds"]}
    return {
        "commission.json": json.dumps(whole, indent=2) + "\n",
        "controller.toml": toml_text(experiment_of(spec, "found.toml")),
        "found.toml": rig_text(found),
        **c_code("found", law),
    }
