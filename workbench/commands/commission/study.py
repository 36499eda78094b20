"""The whole way from a datasheet to a verified controller, on a live rig."""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ...base.errors import InputError
from ...base.toml_text import toml_text
from ...base.trust import allow
from ...control.automatic_tuning import MOVE, SmallMoves
from ...control.controller_spec import ControllerSpec
from ...control.export import coefficients
from ...control.export.c_code import c_code
from ...control.export.link_program import link_program
from ...link.client import LinkClient
from ...link.course import Played, play_course, rest_record
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.run_folder import Run
from ..common.wire_campaign import wire_campaign
from ..excite.study import drive
from ..trace.study import trace_campaign
from .automatic import automatic
from .designs import experiment_of, searched_design
from .looks import WAY, check_rest, check_sides, small_moves
from .motions import doubted, safe_records
from .page import commission_page
from .relay import Relay, relay_reference
from .verify import SINE, STEPS, check_ended, played_ways, table_row

T = TypeVar("T")
TRANSDUCERS = Path(__file__).with_name("transducers.py")


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
    began, rig = time.process_time(), doubted(wanted.rig)
    with LinkClient(wanted.at, wanted.token) as client:
        rig_time = _RigTime(client, rig, wanted.seconds, run)
        progress("looks at the rig at rest: noise, dead or impossible readings")
        rest = rig_time.kept("static", "look", lambda: rest_record(client))
        check_rest(rig, rest)
        progress("moves it by a millimetre: directions, speed, the mode of its oil")
        moves = _small(rig_time)
        law = automatic(rig, moves)
        progress("designs records that every plant within the bounds takes")
        waves = safe_records(rig, law)
        records = {}
        for wave in waves:
            progress(f"plays {wave.name} on the rig, {wave.t[-1]:.3g} s")
            records[wave.name] = rig_time.played(wave, law, "excitation")
        folder = run.dir / "campaign"
        folder.mkdir(exist_ok=True)
        for name, text in wire_campaign(rig, client, rest, records, list(records)[-1:]).items():
            (folder / name).write_text(text, encoding="utf-8")
        progress("asks what the records say that the datasheet does not")
        allow(TRANSDUCERS)
        answer = trace_campaign(folder, effects=[TRANSDUCERS], stage=run.stage, progress=progress, jobs=wanted.jobs)
        progress(answer.sentence)
        found = replace(answer.rig, name=f"{rig.name}-found")
        ways = _ways(wanted, law, rig, found, run, progress)
        judged, seconds, ended = played_ways(client, rig, ways, (*STEPS, SINE), progress)
        rig_time.spend("steps and a sine", "verification", seconds)
    rows = [table_row(each) for each in judged]
    best = ways["found"][0]
    metrics = {
        "verdict": answer.verdict,
        "effects": list(answer.effects),
        "rows": rows,
        "rig_seconds": rig_time.spent,
        "small_moves": asdict(moves),
        "trips": sum("tripped" in str(each.row["tripped"]) for each in judged),
        "ended": ended,
        "played": rig_time.log,
        "controller": "controller.toml",
        "timing": {"computing_seconds": time.process_time() - began},
    }
    (run.dir / "c").mkdir(exist_ok=True)
    files = _files(best, rig, found, metrics)
    subject = Subject(found, [spec for spec, _ in ways.values()])
    return Outcome(metrics, lambda: commission_page(wanted.goal, metrics, judged, answer), {}, files, subject)


class _RigTime:
    """What is played on the rig, and for how long: no longer than is allowed. A record that was kept is not played
    again."""

    def __init__(self, client: LinkClient, rig: Rig, seconds: float, run: Run) -> None:
        self.client, self.rig, self._seconds, self._run = client, rig, seconds, run
        self.spent, self.log = 0.0, list[dict[str, Any]]()

    def spend(self, what: str, why: str, seconds: float) -> None:
        """Note what was played. Raises InputError where it was more than is allowed."""
        self.spent += float(seconds)
        self.log.append({"record": what, "for": why, "seconds": float(seconds)})
        if self.spent > self._seconds:
            raise InputError(f"--minutes: {self.spent / 60:.2g} are over after {what}; allow more")

    def kept(self, name: str, why: str, play: Callable[[], Record]) -> Record:
        """A record, of this run or of the one that it resumes."""

        def compute() -> dict[str, Any]:
            record = play()
            return {"t": record.t, "signals": dict(record.signals)}

        stored = self._run.stage(f"played-{name}", compute)
        record = Record(name, np.asarray(stored["t"]), {key: np.asarray(x) for key, x in stored["signals"].items()})
        self.spend(name, why, record.t[-1])
        return record

    def played(self, wave: Excitation, loop: ControllerSpec, why: str) -> Record:
        """An excitation under the slow loop of the drive."""
        start, controller = float(wave.reference[0]), loop.build(wave.period)
        reference = wave.reference - start
        play = partial(play_course, self.client, self.rig, controller, reference, start, wave.command)
        return self._kept_course(wave.name, why, play)

    def relay(self, way: float, size: float) -> Record:
        """A relay that turns at `way` [m] from the middle, from a command `size` on."""
        period = self.rig.period.value
        relay, middle = Relay(drive(self.rig).loop.build(period), period, size), self.rig.middle
        name, reference = f"relay-{1e3 * way:g}mm", relay_reference(self.rig, way)
        play = partial(play_course, self.client, self.rig, relay, reference, middle, begins=relay.begin)
        return self._kept_course(name, "look", play)

    def _kept_course(self, name: str, why: str, play: Callable[[], Played]) -> Record:
        """Raises InputError where the rig or its guard stops it, and KeyboardInterrupt."""

        def course() -> Record:
            done = play()
            check_ended(name, done.ended)
            return done.record

        return self.kept(name, why, course)


def _small(rig_time: _RigTime) -> SmallMoves:
    """What relays about the middle tell; none is played where the one before found a signal wrong."""
    near = rig_time.relay(MOVE, 0.0)
    far = rig_time.relay(WAY, check_sides(rig_time.rig, near))
    check_sides(rig_time.rig, far)
    return small_moves(rig_time.rig, near, far)


def _ways(
    wanted: Wanted, plain_law: ControllerSpec, rig: Rig, found: Rig, run: Run, progress: Progress
) -> Mapping[str, tuple[ControllerSpec, Rig]]:
    """A controller by rules, one for the datasheet, one for the rig as found; each with the rig that predicts it."""
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


def _named_stage(run: Run, search: str) -> Stage:
    """Stages of one of several searches."""

    def stage(name: str, compute: Callable[[], T]) -> T:
        return run.stage(f"{search}-{name}", compute)

    return stage


def _few(progress: Progress) -> Progress:
    """Of a search, every fiftieth trial."""
    return lambda text: (
        progress(text) if not text.startswith("trial ") or text.split()[1].endswith(("00", "50")) else None
    )


def _files(spec: ControllerSpec, rig: Rig, found: Rig, metrics: Mapping[str, Any]) -> dict[str, str]:
    law = coefficients(spec.build(rig.period.value), rig.period.value)
    whole = {**metrics, "computing_seconds": metrics["timing"]["computing_seconds"]}
    return {
        "commission.json": json.dumps(whole, indent=2) + "\n",
        "controller.toml": toml_text(experiment_of(spec, "found.toml")),
        "found.toml": rig_text(found),
        **{f"c/{name}": text for name, text in {**c_code("found", law), **link_program({"found": law})}.items()},
    }
