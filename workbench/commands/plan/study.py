"""What to record next: for each pair of effects that look alike in a campaign, and each number that it does not tell,
the record of a family that splits or shows it best, judged on the fitted rig and then played with an effect on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import one_blas_thread
from ...identify.found.fitted import fitted_rig
from ...identify.plan.family import PlannedRecord, family, planned
from ...identify.plan.played import check, simulated, windows_of
from ...identify.trace.information import EffectInformation, alternatives, effect_information, sharpened
from ...identify.trace.problem import EstimationProblem, estimation_problem
from ...identify.trace.record_gain import Pair, not_simulated, pairs, unseen_numbers, worth
from ...identify.trace.refit import FittedModel, fit_rig
from ...identify.trace.shortlist import score_effects, unpacked_shortlist
from ...identify.trace.stored import packed, unpacked
from ...identify.trace.workers import trace_workers
from ...loop.drive_simulation import drive
from ...plant.effects import Effect, applies
from ...plant.effects.declared import effects_for
from ...records import Campaign
from ...records.excitation import Excitation, excitation_text
from ...report import Figure, Page
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .metrics import Check, plan_metrics
from .page import plan_page

_PLAYED = 3  # records of a pair that are played with an effect on, until one splits it


@dataclass(frozen=True, eq=False)
class _FittedCampaign:
    """A campaign whose rig is fitted: the effects that this may lack, the rig as fitted, what the records tell now."""

    problem: EstimationProblem
    effects: EffectInformation
    rig: Rig
    now: np.ndarray


def run_plan(
    campaign: Campaign, rig: Rig, stage: Stage, progress: Progress, library: Sequence[Effect] | None = None
) -> Outcome:
    """Plan the next records of a campaign; `library` are the effects to tell apart, else all that are known.

    Raises InputError for a rig without a position sensor, which its drive needs.
    """
    if "position" not in rig.sensors:
        raise InputError(f"rig {rig.name}: no position sensor, which its drive needs; add [sensors.position]")
    every = effects_for(rig) if library is None else library
    with one_blas_thread():
        fitted = _fitted(campaign, rig, [effect for effect in every if applies(effect, rig)], stage, progress)
        records, added = _expected(fitted, stage, progress)
        fit, kappa = fitted.effects.model_fit.fit, fitted.problem.kappa
        alike, unseen = pairs(fitted.effects, fitted.now, added), unseen_numbers(fit, added, kappa)
        gains = {name: worth(name, alike, unseen, fit, sharpened(fit, more, kappa)) for name, more in added.items()}
        checks = _checks(fitted, alike, gains, records, stage, progress)
    metrics = plan_metrics(alike, unseen, gains, records, checks)
    metrics["not_compared"] = not_simulated(fitted.effects, fitted.now)
    files = {row["file"]: excitation_text(records[row["record"]].played) for row in metrics["records"]}

    def draw() -> tuple[Page, Figure]:
        return plan_page(fitted.problem, fitted.effects.candidates, metrics, records)

    return Outcome(metrics, draw, _tables(metrics, records), files, Subject(rig))


def _fitted(
    campaign: Campaign, rig: Rig, library: Sequence[Effect], stage: Stage, progress: Progress
) -> _FittedCampaign:
    problem = estimation_problem(campaign, rig)
    if problem.large:
        problem = problem.only(stage("windows", problem.chosen))
    progress("fit of the rig's numbers")
    model_fit = unpacked(stage("base", lambda: packed(fit_rig(problem))), problem, ())
    ranked = _ranked(problem, model_fit, library, stage, progress)
    effects = effect_information(problem, model_fit, alternatives(ranked, library))
    progress(f"{len(effects.candidates)} effects: what the campaign tells of them")
    now = stage("now", lambda: {"information": effects.of_fit(problem.train)})["information"]
    return _FittedCampaign(problem, effects, fitted_rig(problem, model_fit), now)


def _ranked(
    problem: EstimationProblem, model_fit: FittedModel, library: Sequence[Effect], stage: Stage, progress: Progress
) -> Sequence[Any]:
    """Effects with their scores, where something is missing; else nothing says how strong one would be."""
    if not problem.misses(model_fit.chi2, model_fit.samples):
        return ()
    progress("scores of the effects")
    with trace_workers(1, problem, library, ()) as workers:
        stored = stage("scores", lambda: score_effects(workers, problem, model_fit, library, lambda _: None))
    return unpacked_shortlist(stored, library).ranked


def _expected(
    fitted: _FittedCampaign, stage: Stage, progress: Progress
) -> tuple[dict[str, PlannedRecord], dict[str, np.ndarray]]:
    """The records of the family that the rig takes, and the information of each."""
    ready, records, added = drive(fitted.rig), {}, {}
    for name, design in family(fitted.rig).items():

        def compute(name: str = name, design: Any = design) -> dict[str, Any]:
            record = planned(ready, name, design)
            log = record and simulated(ready, record.played, fitted.problem.train.names)
            if record is None or log is None:
                return {}
            information = fitted.effects.of_further(windows_of(fitted.problem, log))
            waves = {"reference": record.played.reference, "command": record.played.command}
            return {"information": information, **waves}

        progress(f"{name}: in simulation")
        stored = stage(f"record-{name}", compute)
        if stored:
            played = Excitation(name, fitted.rig.period.value, stored["reference"], stored["command"])
            records[name], added[name] = PlannedRecord(name, design, played), stored["information"]
    return records, added


def _checks(
    fitted: _FittedCampaign,
    alike: Sequence[Pair],
    gains: Mapping[str, float],
    records: Mapping[str, PlannedRecord],
    stage: Stage,
    progress: Progress,
) -> dict[tuple[str, str], Check]:
    """For each pair the first of its records that splits it, played with the first effect on too."""
    checks = {}
    for pair in alike:

        def compute(pair: Pair = pair) -> dict[str, Any]:
            for name in pair.helpful(gains)[:_PLAYED]:
                progress(f"{name} with {pair.names[0]} on")
                wave = records[name].played
                played = check(fitted.problem, fitted.effects, fitted.now, fitted.rig, pair.places, wave)
                if played is not None and pair.falls(played["cosine"]):
                    return {"record": name, "played": played}
            return {}

        if stored := stage(f"check-{'-'.join(pair.names)}", compute):
            checks[pair.names] = Check(stored["record"], stored["played"])
    return checks


def _tables(metrics: Mapping[str, Any], records: Mapping[str, PlannedRecord]) -> dict[str, dict[str, np.ndarray]]:
    """What is to be played, by file."""
    waves = {row["record"]: records[row["record"]].played for row in metrics["records"]}
    return {
        name: {"t [s]": wave.t, "reference [m]": wave.reference, "command [1]": wave.command}
        for name, wave in waves.items()
    }
