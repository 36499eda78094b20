"""The whole way from a datasheet to a verified controller, on a live rig."""

import time
from dataclasses import dataclass, field
from functools import partial

from ...base.errors import InputError
from ...control.automatic_tuning import MOVE, SmallMoves
from ...control.controller_spec import ControllerSpec
from ...link.client import LinkClient
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig
from ..common.outcome import Outcome, Progress
from ..common.run_folder import Run
from ..common.wire_campaign import wire_rig
from ..drive.study import Judged
from .allowed import Allowed, allowed, safe
from .automatic import automatic
from .looks import WAY, check_rest, check_sides, small_moves
from .motions import doubted, standard_records
from .obstacles import Barred, obstacles
from .results import Results, barred_outcome, outcome
from .rig_time import RigTime
from .rounds import Found, Searches, campaign_in, found_by, further
from .verify import SINE, SINES, STEPS, Way, played_way, settling_of

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
    stands in the way, what it costs, what to mend. Where something bars every further motion there are only those."""
    began, rig = time.process_time(), doubted(wanted.rig)
    with LinkClient(wanted.at, wanted.token) as client:
        spent = RigTime(client, rig, wanted.seconds, run.stage)
        try:
            results = _commissioned(wanted, spent, run, progress)
        except Barred as barred:
            progress(str(barred))
            return barred_outcome(spent, barred.obstacle, time.process_time() - began)
        finally:
            client.off()
    return outcome(results, spent, run.dir, began)


def _commissioned(wanted: Wanted, spent: RigTime, run: Run, progress: Progress) -> Results:
    """Raises Barred where something is wrong before a controller is searched."""
    rig = spent.rig
    rest, moves = _looks(spent, progress)
    law = automatic(rig, moves)
    searches = Searches(law, wanted.goal, wanted.jobs, run, progress)
    plants = allowed(wire_rig(rig, spent.client))
    records = _played(spent, standard_records(plants.stable(law), law), law, progress)
    progress("searches a controller for the rig as the datasheet has it")
    design = searches.design(rig, "datasheet")
    ways = {"automatic": Way(law, plants.stable(law)), "datasheet": Way(design, plants)}
    judged = [each for name, way in ways.items() for each in played_way(spent, name, way, (*STEPS, SINE), progress)]
    last = _rounds(spent, searches, plants, rest, records, progress)
    judged += last.judged
    if last.way is not None:
        ways["found"] = last.way
    verdict, effects = (last.found.answer.verdict, last.found.answer.effects) if last.found else ("unknown", ())
    barred = obstacles(judged, wanted.goal, verdict, effects, rest, records.values())
    return Results(wanted.goal, moves, ways, judged, last.found, last.reasons, last.ended, barred)


@dataclass
class _Rounds:
    """What the last round found, if one did, its controller, what that did on the rig, what each round left open, and
    why the rounds ended before they were over: what was recorded and found until then stays."""

    found: Found | None = None
    way: Way | None = None
    judged: list[Judged] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    ended: str | None = None


def _rounds(
    spent: RigTime,
    searches: Searches,
    plants: Allowed,
    rest: Record,
    records: dict[str, Record],
    progress: Progress,
) -> _Rounds:
    """`records` gets what the rounds record; `plants` are what the datasheet allows."""
    done, heldout = _Rounds(), list(records)[-1:]
    rig, run, law = spent.rig, searches.run, searches.start
    try:
        for number in range(1, _ROUNDS + 1):
            folder = run.dir / ("campaign" if number == 1 else f"campaign-{number}")
            campaign_in(folder, rig, spent.client, rest, records, heldout)
            found = done.found = found_by(folder, searches, spent.client, number, rig.name)
            way = done.way = Way(found.spec, allowed(wire_rig(found.rig, spent.client)))
            done.judged = played_way(spent, "found", way, (*STEPS, *SINES), progress, number)
            done.reasons.append(found.again(settling_of(done.judged, searches.goal)))
            if not done.reasons[-1] or number == _ROUNDS:
                break
            progress(f"once more: {done.reasons[-1]}")
            waves = further(folder, rig, found, run, progress)
            for each in (way.plants, *([] if found.explains else [plants])):
                waves = safe(each.stable(law), law, waves)
            records |= _played(spent, waves, law, progress)
    except (InputError, Barred) as error:
        progress(str(error))
        done.ended = str(error)
    return done


def _looks(spent: RigTime, say: Progress) -> tuple[Record, SmallMoves]:
    """The rig at rest, and what relays tell; none is played where the one before found a signal wrong."""
    rig = spent.rig
    say("looks at the rig at rest: noise, dead or impossible readings")
    rest = spent.rest(partial(check_rest, rig))
    say("moves it by millimetres: directions, speed, the mode of its oil")
    check = partial(check_sides, rig)
    near = spent.relay(MOVE, 0.0, check, blind=True)
    far = spent.relay(WAY, check_sides(rig, near), check)
    return rest, small_moves(rig, near, far)


def _played(spent: RigTime, waves: list[Excitation], law: ControllerSpec, say: Progress) -> dict[str, Record]:
    records = {}
    for wave in waves:
        say(f"plays {wave.name} on the rig, {wave.t[-1]:.3g} s")
        records[wave.name] = spent.played(wave, law, "excitation")
    return records
