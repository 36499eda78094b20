"""The whole way from a datasheet to a verified controller, on a live rig."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...base.checkpoint import OutOfTime
from ...base.errors import InputError
from ...control.automatic_tuning import MOVE, SmallMoves
from ...control.controller_spec import ControllerSpec
from ...link.client import LinkClient
from ...link.commissioning.allowed import Allowed, allowed, doubted, safe, standard_records
from ...link.commissioning.growth import safe_growth
from ...link.commissioning.obstacles import Barred, obstacles
from ...link.commissioning.relay import WAY, check_rest, check_sides, lets_go, relay_ways, small_moves, with_dither
from ...link.commissioning.rig_time import AGAIN, Computing, RigTime
from ...link.commissioning.verify import (
    SINE,
    SINES,
    STEPS,
    Way,
    foretold,
    goal_of,
    played_way,
    predicted_of,
    rig_decides,
    settling_of,
)
from ...link.course import Judged, wire_rig
from ...link.joined import joined
from ...loop.automatic import automatic, small_way
from ...loop.drive_simulation import drive
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig
from ..common.outcome import Outcome, Progress
from ..common.run_folder import RunFolder
from .results import Results, barred_outcome, outcome
from .rounds import Found, Searches, again, campaign_in, found_by, further

_ROUNDS = 2


@dataclass(frozen=True)
class Wanted:
    """What is commissioned: the datasheet's rig at an address, within `seconds` of its time and `computing` [s] of the
    computer's, for the sake of `goal`."""

    rig: Rig
    at: str
    token: str
    seconds: float
    computing: float
    goal: str
    jobs: int


def run_commission(wanted: Wanted, run: RunFolder, progress: Progress) -> Outcome:
    """commission.json: `verdict` and `effects` of the trace, `rows` of every way in every scenario, `rig_seconds`,
    `computing_seconds` of CPU time, less what the rig took, `trips`, what was `played`, the `controller`'s file and
    the `way` that it is, `rounds`: what each left open, `exact_s`, what the goal would settle in were the numbers known
    exactly, and `obstacles`: what stands in the way, what it costs, what to mend. Where something bars every further
    motion there are only those."""
    with LinkClient(wanted.at, wanted.token) as client:
        rig = doubted(joined(wanted.rig, client.hello))
        if "position" not in rig.sensors:
            raise InputError(f"{wanted.at}: {client.hello.rig} has no channel position, which its loop needs")
        computing = Computing(wanted.computing)
        spent = RigTime(client, rig, wanted.seconds, run.stage, computing)
        try:
            results = _commissioned(wanted, spent, run, progress)
        except Barred as barred:
            progress(str(barred))
            return barred_outcome(spent, barred.obstacle)
    return outcome(results, spent, run.dir)


def _commissioned(wanted: Wanted, spent: RigTime, run: RunFolder, progress: Progress) -> Results:
    """Raises Barred where something is wrong before a controller is searched."""
    rig = spent.rig
    plants = allowed(wire_rig(rig, spent.client))
    rest, moves = looks(spent, plants, progress)
    law = _stable(plants, with_dither(automatic(rig, moves), spent.dither), spent, progress)
    searches = Searches(law, wanted.goal, wanted.jobs, run, progress, spent.computing)
    records = _played(spent, standard_records(plants.stable(law), law), law, progress)
    progress("searches a controller for the rig as the datasheet has it")
    design = searches.designs(rig, "datasheet")[0]
    ways = {"automatic": Way(law, plants.stable(law)), "datasheet": Way(design, plants)}
    judged = [each for name, way in ways.items() for each in played_way(spent, name, way, (*STEPS, SINE), progress)]
    rounds, ended = _rounds(spent, searches, plants, rest, records)
    best = _best(rounds, wanted.goal)
    if best is not None:
        ways["found"] = best.way
        judged += best.judged
    found, reasons = best and best.found, [each.reason for each in rounds]
    verdict, effects = (found.answer.verdict, found.answer.effects) if found else ("", ())
    barred = obstacles(judged, wanted.goal, verdict, effects, rest, records.values(), spent.dither)
    exact = best and best.exact
    return Results(wanted.goal, moves, ways, judged, found, exact, reasons, ended, barred, spent.computing.cut)


def _stable(plants: Allowed, law: ControllerSpec, spent: RigTime, say: Progress) -> ControllerSpec:
    """The controller by rules, or in its place the slow loop of the drive, where small moves told too little of the rig
    for the rules: where it is not stable on the rig of the datasheet."""
    kept = plants.stable(law)
    if len(kept.p) and (kept.p[0] == plants.p[0]).all():
        return law
    say("the controller by rules is unstable on the rig of the datasheet: a slow position loop takes its place")
    return with_dither(drive(spent.rig).loop.named(law.name), spent.dither)


@dataclass(frozen=True)
class _Round:
    """What a round found, its controller, what that did on the rig, what the goal would settle in [s] were the rig's
    numbers known exactly, and what it left open."""

    found: Found
    way: Way
    judged: list[Judged]
    exact: float | None
    reason: str


def _rounds(
    spent: RigTime, searches: Searches, plants: Allowed, rest: Record, records: dict[str, Record]
) -> tuple[list[_Round], str | None]:
    """Every round, and why they ended before they were over, if they did: what was recorded and found until then stays.

    `records` gets what the rounds record; `plants` are what the datasheet allows.
    """
    done, heldout = list[_Round](), list(records)[-1:]
    rig, run, law, say = spent.rig, searches.run, searches.start, searches.say
    try:
        for number in range(1, _ROUNDS + 1):
            folder = run.dir / ("campaign" if number == 1 else f"campaign-{number}")
            campaign_in(folder, rig, spent.client, rest, records, heldout)
            decide = partial(rig_decides, spent, goal=searches.goal, number=number, say=say)
            found = found_by(folder, searches, number, rig, decide)
            way = Way(found.spec, allowed(wire_rig(found.rig, spent.client)))
            judged = played_way(spent, "found", way, (*STEPS, *SINES), say, number)
            goal = goal_of(judged, searches.goal)
            exact = goal and found.exact(goal.scenario, spent.client)
            reason = again(goal and goal.prediction["settling_s"], goal and goal.row["settling_s"], exact)
            done.append(_Round(found, way, judged, exact, reason))
            if not reason or number == _ROUNDS:
                break
            if spent.computing.over(AGAIN, "another round")():
                raise OutOfTime
            say(f"once more: {reason}")
            waves = further(folder, rig, found, run, say)
            for each in (way.plants, *([] if found.explains else [plants])):
                waves = safe(each.stable(law), law, waves)
            records |= _played(spent, waves, law, say)
    except (InputError, Barred) as error:
        say(str(error))
        return done, str(error)
    except OutOfTime:
        pass  # the computer's time knows what it cut short
    return done, None


def _best(rounds: Sequence[_Round], goal: str) -> _Round | None:
    """The round whose controller did the goal soonest on the rig; one whose prediction held comes before all whose did
    not."""

    def rank(each: _Round) -> tuple[bool, float]:
        measured = settling_of(each.judged, goal)
        held = foretold(predicted_of(each.judged, goal), measured)
        return not held, np.inf if measured is None else measured

    return min(reversed(rounds), key=rank, default=None)


def looks(spent: RigTime, plants: Allowed, say: Progress) -> tuple[Record, SmallMoves]:
    """The rig at rest, and what relays tell, which grow as fast as all plants take it; none is played where the one
    before found a signal wrong."""
    rig = spent.rig
    say("looks at the rig at rest: noise, dead or impossible readings")
    rest = spent.rest(partial(check_rest, rig))
    say("moves it by millimetres: directions, speed, the mode of its oil")
    check, way = partial(check_sides, rig), small_way(rig)
    growth = safe_growth(plants, way)
    spent.stay_on(True)
    near = spent.relay(way, 0.0, check, True, growth)
    size = check_sides(rig, near)
    if not lets_go(near):
        spent.stay_on(False)
    else:
        dither = spent.free(size)
        words = f"{100 * dither.amplitude:.2g} % at {dither.frequency:g} Hz"
        say(f"the valve stays open without a command: from now on a dither of {words} frees it")
        near = spent.relay(way, 0.0, check, growth=growth)
        size = check_sides(rig, near)
    return rest, small_moves(rig, near, _far(spent, plants, WAY / MOVE * way, size, say) or near)


def _far(spent: RigTime, plants: Allowed, way: float, size: float, say: Progress) -> Record | None:
    """A relay of a larger way, from the command `size` on that got the jack moving; None where the limits leave it no
    room."""
    try:
        growth = safe_growth(plants, way, size)
    except Barred as barred:
        say(str(barred))
        return None
    check = partial(check_sides, spent.rig)
    return spent.relay(way, size, lambda record: relay_ways(record) and check(record), growth=growth)


def _played(spent: RigTime, waves: list[Excitation], law: ControllerSpec, say: Progress) -> dict[str, Record]:
    records = {}
    for wave in waves:
        say(f"plays {wave.name} on the rig, {wave.t[-1]:.3g} s")
        records[wave.name] = spent.played(wave, law, "excitation")
    return records
