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
from .gain import Question, numbers, pairs, worth
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
        alike, unseen = pairs(known.asked, known.now, added), numbers(fit, added, kappa)
        checks = _checks(known, alike, records, stage, progress)
    gains = {name: worth(name, alike, unseen, fit, sharpened(fit, more, kappa)) for name, more in added.items()}
    chosen = sorted({q.best for q in (*alike, *unseen) if q.best}, key=lambda name: -gains[name])
    metrics: dict[str, Any] = {
        "pairs": [_pair_json(question, checks) for question in alike],
        "numbers": [_number_json(question) for question in unseen],
        "records": [_record_json(records[name], gains[name], alike, unseen) for name in chosen],
    }
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
    known: _Campaign, alike: Sequence[Question], records: Mapping[str, PlannedRecord], stage: Stage, progress: Progress
) -> dict[tuple[str, ...], Any]:
    """For each pair its record played with the first effect on."""
    checks = {}
    for question in alike:
        if question.best:
            first, second = question.places
            wave = records[question.best].played
            progress(f"{question.best} with {question.names[0]} on")
            checks[question.names] = stage(
                f"check-{'-'.join(question.names)}",
                lambda wave=wave, pair=(first, second): {
                    "played": check(known.problem, known.asked, known.now, known.rig, pair, wave)
                },
            )["played"]
    return checks


def _pair_json(question: Question, checks: Mapping[tuple[str, ...], Any]) -> dict[str, Any]:
    return {
        "effects": list(question.names),
        "cosine": question.now,
        "after": dict(question.after),
        "best": question.best,
        "played": checks.get(question.names),
    }


def _number_json(question: Question) -> dict[str, Any]:
    """`share`: 95 % interval over the declared range."""
    return {
        "number": question.names[0],
        "share": question.now,
        "after": dict(question.after),
        "best": question.best,
    }


def _record_json(
    record: PlannedRecord, information: float, alike: Sequence[Question], unseen: Sequence[Question]
) -> dict[str, Any]:
    design = record.design
    return {
        "record": record.name,
        "file": f"{record.name}.csv",
        "information": information,
        "splits": [list(question.names) for question in alike if question.best == record.name],
        "tells": [question.names[0] for question in unseen if question.best == record.name],
        "kind": design.kind,
        "signal": design.signal,
        "peak": record.peak,
        "seconds": design.seconds * design.repeat,
        "band": None if design.band is None else list(design.band),
    }
