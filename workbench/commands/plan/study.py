"""What to record next: for each pair of effects that look alike in a campaign, and each number that it does not tell,
the record of a family that splits or shows it best, judged on the fitted rig and then played with an effect on."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import one_blas_thread
from ...identify.plan.family import PlannedRecord, family, planned
from ...identify.plan.played import simulated, windows_of, with_effect
from ...identify.trace.record_gain import Pair, not_simulated
from ...loop.drive_simulation import drive
from ...plant.effects import Effect
from ...plant.effects.declared import effects_for
from ...records import Campaign
from ...records.excitation import Excitation, excitation_text
from ...report import Figure, Page
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .fitted import Told, checks, fitted_campaign, told
from .metrics import plan_metrics, record_wave
from .page import plan_page


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
        now = told(fitted_campaign(campaign, rig, every, stage, progress), stage, progress)
        records, added = _expected(now, stage, progress)
        expected = now.expected(added)

        def played(pair: Pair, name: str) -> dict[str, float] | None:
            progress(f"{name} with {pair.names[0]} on")
            affected = drive(with_effect(now.fitted.rig, now.effects.candidates[pair.places[0]]))
            record = simulated(affected, records[name].played, now.fitted.problem.train.names)
            return record and now.played(pair, record)

        found = checks(expected.alike, expected.gains, played, stage)
    metrics = plan_metrics(
        expected.alike, expected.unseen, expected.gains, lambda name: record_wave(records[name]), found
    )
    metrics["not_compared"] = not_simulated(now.effects, now.now)
    files = {row["file"]: excitation_text(records[row["record"]].played) for row in metrics["records"]}

    def draw() -> tuple[Page, Figure]:
        return plan_page(now.fitted.problem, now.effects.candidates, metrics, records)

    return Outcome(metrics, draw, _tables(metrics, records), files, Subject(rig))


def _expected(now: Told, stage: Stage, progress: Progress) -> tuple[dict[str, PlannedRecord], dict[str, np.ndarray]]:
    """The records of the family that the rig takes, and the information of each."""
    problem, rig = now.fitted.problem, now.fitted.rig
    ready, records, added = drive(rig), {}, {}
    for name, design in family(rig).items():

        def compute(name: str = name, design: Any = design) -> dict[str, Any]:
            record = planned(ready, name, design)
            log = record and simulated(ready, record.played, problem.train.names)
            if record is None or log is None:
                return {}
            waves = {"reference": record.played.reference, "command": record.played.command}
            return {"information": now.effects.of_further(windows_of(problem, log)), **waves}

        progress(f"{name}: in simulation")
        stored = stage(f"record-{name}", compute)
        if stored:
            played = Excitation(name, rig.period.value, stored["reference"], stored["command"])
            records[name], added[name] = PlannedRecord(name, design, played), stored["information"]
    return records, added


def _tables(metrics: Mapping[str, Any], records: Mapping[str, PlannedRecord]) -> dict[str, dict[str, np.ndarray]]:
    """What is to be played, by file."""
    waves = {row["record"]: records[row["record"]].played for row in metrics["records"]}
    return {
        name: {"t [s]": wave.t, "reference [m]": wave.reference, "command [1]": wave.command}
        for name, wave in waves.items()
    }
