"""Made rigs watched: what was told, beside what wore, when it began, and what it cost the loop by then."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import timedelta
from functools import partial
from itertools import permutations
from pathlib import Path
from time import process_time
from typing import Any

from workbench.base.process_pool import Jobs, one_blas_thread, process_pool
from workbench.commands.common.outcome import Outcome, Progress, no_checkpoint
from workbench.commands.common.run_folder import RunFolder
from workbench.commands.common.step_experiment import StepConfig
from workbench.commands.watch.study import run_watch, tuned_loop
from workbench.identify.watch.forecast import LIMITS
from workbench.identify.watch.healthy_rate import poisson_rate
from workbench.identify.watch.history import history
from workbench.identify.watch.loop_costs import TunedLoop, margins
from workbench.identify.watch.reader import SessionReader, read_sessions
from workbench.plant.effects import known_effects
from workbench.plant.effects.declared import effect_use
from workbench.records.dated_sessions import dated_sessions
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig

from ..trace.campaigns.draw import CampaignPlan, drawn_scene
from ..trace.campaigns.scene import Scene
from .courses import coverage
from .healthy import drawn_year, false_alarms, resampled_year
from .made_rig import FIRST_DAY, WEEK, MadeRig, Wear, worn, write_sessions
from .page import names, page

A_YEAR = 0.5
RIG = "jack-10t"
HURT = 1.0  # dB of gain margin
COURSES = 400  # of each pace, of which forecasts are made
_AHEAD = 104  # sessions, in which a forecast has to come true
Row = dict[str, Any]


def run_watch_study(
    rigs: Sequence[MadeRig], loop: StepConfig, years: int, run: RunFolder, progress: Progress, jobs: Jobs = 1
) -> Outcome:
    """`rows`, one a rig; `summary` of them; `healthy`: alarms in drawn years of the first healthy rig; `forecasts`
    of drawn wears, by pace."""

    def done(row: Row) -> None:
        progress(f"{row['id']}: told {row['told']}, {names(row['alarms'])}")

    with process_pool(jobs, partial(partial, watched, loop=loop, folder=run.dir / "rigs")) as work:
        rows = work({rig.id: rig for rig in rigs}, run.stage, done)
    well = next((rig for rig in rigs if rig.wear is None), None)
    drawn = run.stage("healthy", partial(_drawn, well, years, run.dir / "rigs")) if well else None
    forecast = run.stage("forecasts", partial(coverage, COURSES, 0))
    metrics = {"rows": rows, "summary": summary(rows), "healthy": drawn, "forecasts": forecast}
    return Outcome(metrics, lambda: page(metrics))


def watched(rig: MadeRig, loop: StepConfig, folder: Path) -> Row:
    """One made rig: written, watched, and judged; its recordings are removed again."""
    scene, begun = drawn_scene(CampaignPlan(rig.seed, "single", noise=rig.noise, sharp=0.5)), process_time()
    own = folder / rig.id
    shutil.rmtree(own, ignore_errors=True)
    truths = write_sessions(rig, scene, own)
    made = process_time()
    found = run_watch(dated_sessions(own), load_rig(RIG), loop, A_YEAR, None, no_checkpoint, lambda _: None).metrics
    if rig.wear is not None:
        shutil.rmtree(own)
    days = [each["date"] for each in found["sessions"]]
    alarm = found["alarms"][0] if found["alarms"] else None
    told = days.index(alarm["told"]) if alarm else None
    tuned = tuned_loop(loop, load_rig(RIG))
    lost = _lost(rig, tuned, truths)
    name = rig.wear.name if rig.wear else None
    return {
        "id": rig.id,
        "wear": name,
        "beside": rig.beside.wear.name if rig.beside and rig.beside.wear else None,
        "growth": rig.growth if rig.wear else None,
        "noise": rig.noise,
        "supply": rig.supply,
        "thermometer": rig.thermometer,
        "begins": rig.begins if rig.wear else None,
        "mended": rig.mended,
        "sessions": rig.sessions,
        "told": told,
        "gone": days.index(alarm["until"]) if alarm and alarm["until"] else None,
        "alarms": [{key: each[key] for key in ("effect", "among")} for each in found["alarms"]],
        "right": alarm is not None and _is_right(rig, found["alarms"]),
        "wrong": any(_is_wrong(rig, each) for each in found["alarms"]),
        "share": rig.share(told) if told is not None else None,
        "lost_db": None if told is None else lost[told],
        "hurt": next((t for t, each in enumerate(lost) if each is not None and each >= HURT), None),
        "forecast": [each | {"true": _true_day(rig, tuned, scene, each)} for each in found["forecast"]],
        "chi2": [each["chi2"] for each in found["sessions"]],
        "made_cpu_s": made - begun,
        "cpu_s": process_time() - made,
    }


def _is_right(rig: MadeRig, alarms: Sequence[Row]) -> bool:
    """Whether every wear has an alarm of its own, with its name alone or among others, or without one where the library
    has none for it."""

    def tells(alarm: Row, wear: Wear) -> bool:
        return alarm["effect"] is None if wear.is_unnamed else bool(alarm["effect"]) and wear.name in alarm["among"]

    each = permutations(alarms, len(rig.wears))
    return bool(rig.wears) and any(all(map(tells, some, rig.wears)) for some in each)


def _is_wrong(rig: MadeRig, alarm: Row) -> bool:
    """Whether an alarm names what does not wear, and nothing that does."""
    return alarm["effect"] is not None and not {wear.name for wear in rig.wears} & set(alarm["among"])


def _lost(rig: MadeRig, loop: TunedLoop, truths: Sequence[Mapping[str, float]]) -> list[float | None]:
    """dB of gain margin that the loop has lost in each session since the one before the wear began; none is known of
    what the library has no effect for."""
    if any(wear.is_unnamed for wear in rig.wears):
        return [None] * len(truths)
    found = [margins(loop, true_rig(rig, each, t)).get("gain_margin_db") for t, each in enumerate(truths)]
    before = found[max(rig.begins - 1, 0)]
    return [None if each is None or before is None else before - each for each in found]


def _true_day(rig: MadeRig, loop: TunedLoop, scene: Scene, row: Row) -> str | None:
    """The day on which the figure of a forecast passes its limit on the rig as it is made; None within two years."""
    for session in range(rig.sessions - 1, rig.sessions + _AHEAD):
        value = margins(loop, true_rig(rig, worn(rig, scene.true, session)[0], session)).get(row["figure"])
        if value is None or (value - row["limit"]) * LIMITS[row["figure"]][1] >= 0:
            return str(FIRST_DAY + timedelta(days=WEEK * session))
    return None


def true_rig(rig: MadeRig, numbers: Mapping[str, float], session: int) -> Rig:
    """The rig as it is made in a session, by numbers that are worn already."""
    base = load_rig(RIG)
    known = {
        n: replace(number, value=numbers[n], low=None, high=None) for n, number in base.numbers.items() if n in numbers
    }
    effects = []
    for part in rig.parts:
        share = part.share(session)
        if part.wear is None or part.wear.cause is None or share == 0:
            continue
        effect = next(effect for effect in known_effects() if effect.name == part.wear.name)
        off = {n.name: (n.off, n.typical) for n in effect.numbers if n.off is not None}
        strong = {name: low + share * part.wear.most * (typical - low) for name, (low, typical) in off.items()}
        effects.append(effect_use(effect, strong, "made"))
    return replace(base, numbers={**base.numbers, **known}, effects=(*base.effects, *effects))


def _drawn(rig: MadeRig, years: int, folder: Path) -> Row:
    reader = SessionReader(load_rig(RIG), lambda _: None)
    sessions, evidence = read_sessions(reader, dated_sessions(folder / rig.id).sessions, [])
    days = [float((each.day - sessions[0].day).days) for each in sessions]
    known = history(evidence, days, [False] * len(days), [each.temperature for each in sessions])
    found = {"years": years, "asked_a_year": A_YEAR, "supply": rig.supply}
    for name, draw in {"resampled": resampled_year, "other_laws": partial(drawn_year, supply=rig.supply)}.items():
        with one_blas_thread():
            alarms = false_alarms(known, years, A_YEAR, draw)
        rate = poisson_rate(alarms, years)
        found[name] = {"alarms": alarms, "a_year": [rate.value, rate.low, rate.high]}
    return found


def summary(rows: Sequence[Row]) -> Row:
    """Counts over all rigs."""
    worn, well = [row for row in rows if row["wear"]], [row for row in rows if not row["wear"]]
    told = [row for row in worn if row["told"] is not None]
    early = [row for row in told if row["told"] < row["begins"]]
    before = [row for row in told if row["hurt"] is None or row["told"] <= row["hurt"]]
    return {
        "worn": len(worn),
        "told": len(told),
        "told_too_soon": len(early),
        "right": sum(row["right"] for row in worn),
        "wrong": sum(row["wrong"] for row in rows),
        "before_hurt": len(before),
        "healthy": len(well),
        "false_alarms": sum(row["told"] is not None for row in well),
    }
