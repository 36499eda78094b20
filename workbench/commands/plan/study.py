"""What to record next: for each pair of effects that look alike in a campaign, and each number that it does not tell,
the record of a family that splits or shows it best, judged on the fitted rig and then played with an effect on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import one_blas_thread
from ...identify.trace import rule as decide
from ...identify.trace.foresight import Foresight, alternatives, foresight, sharpened
from ...identify.trace.problem import EstimationProblem, estimation_problem
from ...identify.trace.refit import FittedModel, fit_rig
from ...identify.trace.shortlist import score_effects, unpacked_shortlist
from ...identify.trace.stored import packed, unpacked
from ...plant.effects import Effect, applies
from ...records import Campaign
from ...records.excitation import Excitation, excitation_text
from ...rigs.rig import Rig
from ..common.fit_result import fitted_rig
from ..common.outcome import Outcome, Progress, Stage
from ..excite.study import drive
from ..trace.study import effects_for
from .family import PlannedRecord, family, planned
from .gain import Pair, UnseenNumber, pairs, unseen_numbers, worth
from .page import plan_page
from .played import check, simulated, windows_of


@dataclass(frozen=True, eq=False)
class _Campaign:
    """A campaign whose rig is fitted: what is asked about it, the rig as fitted, what it tells now."""

    problem: EstimationProblem
    asked: Foresight
    rig: Rig
    now: np.ndarray


def run_plan(
    campaign: Campaign, rig: Rig, stage: Stage, progress: Progress, library: Sequence[Effect] | None = None
) -> Outcome:
    """Plan the next records of a campaign; `library` are the effects that are told apart, else all that are known.

    Raises InputError for a rig without a position sensor, which its drive needs.
    """
    if "position" not in rig.sensors:
        raise InputError(f"rig {rig.name}: no position sensor, which its drive needs; add [sensors.position]")
    every = effects_for(rig) if library is None else library
    with one_blas_thread():
        known = _fitted(campaign, rig, [effect for effect in every if applies(effect, rig)], stage, progress)
        records, added = _expected(known, stage, progress)
        fit, kappa = known.asked.model_fit.fit, known.problem.kappa
        alike, unseen = pairs(known.asked, known.now, added), unseen_numbers(fit, added, kappa)
        gains = {name: worth(name, alike, unseen, fit, sharpened(fit, more, kappa)) for name, more in added.items()}
        checks = _checks(known, alike, gains, records, stage, progress)
    rows = [_pair_json(pair, gains, checks) for pair in alike], [_number_json(number, gains) for number in unseen]
    best = {row["best"] for part in rows for row in part if row["best"]}
    chosen = sorted(best, key=lambda name: -gains[name])
    listed = [_record_json(records[name], gains[name], *rows) for name in chosen]
    metrics = {"pairs": rows[0], "numbers": rows[1], "records": listed}
    page, picture = plan_page(known.problem, metrics, records)
    return Outcome(metrics, page, picture, files={f"{n}.csv": excitation_text(records[n].played) for n in chosen})


def _fitted(campaign: Campaign, rig: Rig, library: Sequence[Effect], stage: Stage, progress: Progress) -> _Campaign:
    problem = estimation_problem(campaign, rig)
    if problem.large:
        problem = problem.only(stage("windows", problem.chosen))
    progress("fit of the rig's numbers")
    model_fit = unpacked(stage("base", lambda: packed(fit_rig(problem))), problem, ())
    ranked = _ranked(problem, model_fit, library, stage, progress)
    asked = foresight(problem, model_fit, alternatives(ranked, library))
    progress(f"{len(asked.candidates)} effects: what the campaign tells of them")
    now = stage("now", lambda: {"information": asked.now(problem.train)})["information"]
    return _Campaign(problem, asked, fitted_rig(problem, model_fit), now)


def _ranked(
    problem: EstimationProblem, model_fit: FittedModel, library: Sequence[Effect], stage: Stage, progress: Progress
) -> Sequence[Any]:
    """Effects with their scores, where something is missing; else nothing says how strong one would be."""
    if not decide.misfit(model_fit.chi2, model_fit.samples, problem.kappa):
        return ()
    progress("scores of the effects")
    stored = stage("scores", lambda: score_effects(problem, model_fit, library, lambda _: None))
    return unpacked_shortlist(stored, library).ranked


def _expected(
    known: _Campaign, stage: Stage, progress: Progress
) -> tuple[dict[str, PlannedRecord], dict[str, np.ndarray]]:
    """The records of the family that the rig takes, and the information of each."""
    ready, records, added = drive(known.rig), {}, {}
    for name, design in family(known.rig).items():

        def compute(name: str = name, design: Any = design) -> dict[str, Any]:
            record = planned(ready, name, design)
            log = record and simulated(ready, record.played, known.problem.train.names)
            if record is None or log is None:
                return {}
            information = known.asked.expected(windows_of(known.problem, log))
            waves = {"reference": record.played.reference, "command": record.played.command}
            return {"information": information, **waves}

        progress(f"{name}: in simulation")
        stored = stage(f"record-{name}", compute)
        if stored:
            played = Excitation(name, known.rig.period.value, stored["reference"], stored["command"])
            records[name], added[name] = PlannedRecord(name, design, played), stored["information"]
    return records, added


def _checks(
    known: _Campaign,
    alike: Sequence[Pair],
    gains: Mapping[str, float],
    records: Mapping[str, PlannedRecord],
    stage: Stage,
    progress: Progress,
) -> dict[tuple[str, str], Any]:
    """For each pair its record played with the first effect on."""
    checks = {}
    for pair in alike:
        if best := pair.best(gains):
            progress(f"{best} with {pair.names[0]} on")

            def compute(pair: Pair = pair, best: str = best) -> dict[str, Any]:
                wave = records[best].played
                return {"played": check(known.problem, known.asked, known.now, known.rig, pair.places, wave)}

            checks[pair.names] = stage(f"check-{'-'.join(pair.names)}", compute)["played"]
    return checks


def _pair_json(pair: Pair, gains: Mapping[str, float], checks: Mapping[tuple[str, str], Any]) -> dict[str, Any]:
    """`played`: the cosine with the record as played with the first effect on, and what each explains then."""
    return {
        "effects": list(pair.names),
        "cosine": pair.cosine,
        "after": dict(pair.after),
        "best": pair.best(gains),
        "played": checks.get(pair.names),
    }


def _number_json(number: UnseenNumber, gains: Mapping[str, float]) -> dict[str, Any]:
    """`share`: 95 % interval over the declared range."""
    return {
        "number": number.name,
        "share": number.share,
        "after": dict(number.after),
        "best": number.best(gains),
    }


def _record_json(
    record: PlannedRecord, information: float, alike: Sequence[Mapping[str, Any]], unseen: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    design = record.design
    return {
        "record": record.name,
        "file": f"{record.name}.csv",
        "information": information,
        "splits": [row["effects"] for row in alike if row["best"] == record.name],
        "tells": [row["number"] for row in unseen if row["best"] == record.name],
        "kind": design.kind,
        "signal": design.signal,
        "peak": record.peak,
        "seconds": design.seconds * design.repeat,
        "band": None if design.band is None else list(design.band),
    }
