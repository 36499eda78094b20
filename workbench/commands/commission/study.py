"""The whole way from a datasheet to a verified controller, on a live rig."""

import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ...base.errors import InputError
from ...base.toml_text import toml_text
from ...control.automatic_tuning import MOVE, SmallMoves
from ...control.controller_spec import ControllerSpec
from ...control.export import coefficients
from ...control.export.c_code import c_code
from ...control.export.link_program import link_program
from ...link.client import LinkClient
from ...link.course import rest_record
from ...loop.limit import settling_limit
from ...loop.scenarios import SCENARIOS
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress
from ..common.run_folder import Run
from ..drive.study import Judged
from .automatic import automatic
from .designs import experiment_of
from .looks import WAY, check_rest, check_sides, small_moves
from .motions import doubted, safe, standard_records
from .obstacles import Obstacle, obstacles
from .page import commission_page
from .rig_time import RigTime
from .rounds import Found, Searches, campaign_in, found_by, further
from .verify import SINE, STEPS, best_way, limit_row, played_way, settling_of, table_row

_ROUNDS = 2


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
    `computing_seconds`, `trips`, what was `played`, the `controller`'s file and the `way` that it is, `rounds`: what
    each left open, `exact_s`, what the goal would settle in were the numbers known exactly, and `obstacles`: what
    stands in the way, what it costs, what to mend."""
    began, rig = time.process_time(), doubted(wanted.rig)
    with LinkClient(wanted.at, wanted.token) as client:
        spent = RigTime(client, rig, wanted.seconds, run)
        rest, moves = _looks(spent, progress)
        law = automatic(rig, moves)
        searches = Searches(law, wanted.goal, wanted.jobs, run, progress)
        records = _played(spent, standard_records(rig, law), law, progress)
        progress("searches a controller for the rig as the datasheet has it")
        ways = {"automatic": (law, rig), "datasheet": (searches.design(rig, "datasheet"), rig)}
        judged = [each for way, (spec, model) in ways.items() for each in _verified(spent, way, spec, model, progress)]
        found, own, reasons, ended = _rounds(spent, searches, rest, records, law, progress)
    judged += own
    if found is not None:
        ways["found"] = (found.spec, found.rig)
    verdict, effects = (found.answer.verdict, found.answer.effects) if found else ("unknown", ())
    barred = obstacles(judged, wanted.goal, verdict, effects, rest, records.values())
    return _outcome(wanted, found, moves, ways, judged, spent, reasons, ended, barred, began)


def _rounds(
    spent: RigTime,
    searches: Searches,
    rest: Record,
    records: dict[str, Record],
    law: ControllerSpec,
    progress: Progress,
) -> tuple[Found | None, list[Judged], list[str], str | None]:
    """What the last round found, if one did, what its controller did on the rig, what each round left open, and why the
    rounds ended before they were over: what was recorded and found until then stays."""
    found, own, reasons, heldout = None, list[Judged](), list[str](), list(records)[-1:]
    rig, run = spent.rig, spent.run
    try:
        for number in range(1, _ROUNDS + 1):
            folder = run.dir / ("campaign" if number == 1 else f"campaign-{number}")
            campaign_in(folder, rig, spent.client, rest, records, heldout)
            found = found_by(folder, searches, spent.client, number, rig.name)
            own = _verified(spent, "found", found.spec, found.rig, progress)
            reasons.append(found.again(settling_of(own, searches.goal)))
            if not reasons[-1] or number == _ROUNDS:
                break
            progress(f"once more: {reasons[-1]}")
            waves = safe(rig, law, further(folder, rig, found, run, progress), found.rig)
            records |= _played(spent, waves, law, progress)
    except InputError as error:
        progress(str(error))
        return found, own, reasons, str(error)
    return found, own, reasons, None


def _looks(spent: RigTime, say: Progress) -> tuple[Record, SmallMoves]:
    """The rig at rest, and what relays about the middle tell; none is played where the one before found a signal
    wrong."""
    say("looks at the rig at rest: noise, dead or impossible readings")
    rest = spent.kept("static", "look", lambda: rest_record(spent.client))
    check_rest(spent.rig, rest)
    say("moves it by millimetres: directions, speed, the mode of its oil")
    near = spent.relay(MOVE, 0.0)
    far = spent.relay(WAY, check_sides(spent.rig, near))
    check_sides(spent.rig, far)
    return rest, small_moves(spent.rig, near, far)


def _played(spent: RigTime, waves: list[Excitation], law: ControllerSpec, say: Progress) -> dict[str, Record]:
    records = {}
    for wave in waves:
        say(f"plays {wave.name} on the rig, {wave.t[-1]:.3g} s")
        records[wave.name] = spent.played(wave, law, "excitation")
    return records


def _verified(spent: RigTime, way: str, spec: ControllerSpec, model: Rig, say: Progress) -> list[Judged]:
    """A way's controller, predicted by its rig, in every scenario at the live rig."""
    judged, seconds = played_way(spent.client, spent.rig, way, spec, model, (*STEPS, SINE), say)
    spent.spend(f"steps and a sine: {way}", "verification", seconds)
    return judged


def _outcome(
    wanted: Wanted,
    found: Found | None,
    moves: SmallMoves,
    ways: Mapping[str, tuple[ControllerSpec, Rig]],
    judged: list[Judged],
    spent: RigTime,
    reasons: list[str],
    ended: str | None,
    barred: list[Obstacle],
    began: float,
) -> Outcome:
    rows, rig = [table_row(each) for each in judged], found.rig if found else spent.rig
    rows += [limit_row(name, settling_limit(rig, SCENARIOS[name]).settling) for name in STEPS]
    way = best_way(rows, wanted.goal)
    metrics = {
        "verdict": found.answer.verdict if found else "unknown",
        "effects": list(found.answer.effects) if found else [],
        "rows": rows,
        "rig_seconds": spent.spent,
        "trips": sum(each.row["tripped"] is not None for each in judged),
        "ended": next((each.row["tripped"] for each in judged if each.row["tripped"]), ended),
        "played": spent.log,
        "controller": "controller.toml",
        "way": way,
        "rounds": reasons,
        "exact_s": found.exact if found else None,
        "obstacles": [asdict(each) for each in barred],
        "small_moves": asdict(moves),
        "timing": {"computing_seconds": time.process_time() - began},
    }
    (spent.run.dir / "c").mkdir(exist_ok=True)
    files = _files(ways[way][0], wanted.rig, rig, metrics)
    subject, sentence = (
        Subject(rig, [spec for spec, _ in ways.values()]),
        found.answer.sentence if found else ended or "",
    )
    return Outcome(metrics, lambda: commission_page(wanted.goal, metrics, judged, sentence), {}, files, subject)


def _files(spec: ControllerSpec, rig: Rig, found: Rig, metrics: Mapping[str, Any]) -> dict[str, str]:
    law = coefficients(spec.build(rig.period.value), rig.period.value)
    whole = {**metrics, "computing_seconds": metrics["timing"]["computing_seconds"]}
    return {
        "commission.json": json.dumps(whole, indent=2) + "\n",
        "controller.toml": toml_text(experiment_of(spec, "found.toml")),
        "found.toml": rig_text(found),
        **{f"c/{name}": text for name, text in {**c_code("found", law), **link_program({"found": law})}.items()},
    }
