"""What to record next: for each pair of effects that look alike in a campaign, and each number that it does not tell,
the record of a family that splits or shows it best, judged on the fitted rig and then played with an effect on.

What is planned for has parts, each a jack with its fitted campaign: one, or the legs of a platform. The names of a
part's effects and numbers begin with its own, "leg4."; that of a jack alone is "".
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Any, Protocol, TypeVar

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import one_blas_thread
from ...identify.fit.free_parameters import Candidate
from ...identify.plan.family import PlannedRecord, family, planned
from ...identify.plan.motions import PlannedMotion
from ...identify.plan.played import simulated, windows_of, with_effect
from ...identify.trace.record_gain import Pair, not_simulated
from ...loop.drive_simulation import DriveSimulation, drive
from ...plant.effects import Effect
from ...plant.effects.declared import effects_for
from ...records import Campaign, Record
from ...records.excitation import Excitation
from ...report import Figure, Page
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .fitted import Told, checks, fitted_campaign, told
from .metrics import plan_metrics
from .page import plan_page

Wave = TypeVar("Wave", PlannedRecord, PlannedMotion)
Kept = dict[str, Any]  # numbers and arrays of a wave, from which it is made again
Logs = Mapping[str, Record]  # what is logged of a record, by part


class Player(Protocol[Wave]):
    """A jack or a platform in simulation, which plays the records of a family."""

    def takes(self, name: str) -> tuple[Kept, Logs] | None:
        """A record of the family as large as it is taken, and its log; None where it is taken at no size."""
        ...

    def made(self, name: str, kept: Kept) -> Wave:
        """The wave of a record that is taken."""
        ...

    def affected(self, part: str, candidate: Candidate) -> "Player[Wave]":
        """The player with an effect on in a part."""
        ...

    def log(self, wave: Wave) -> Logs | None:
        """A wave as it is played; None where it cannot be."""
        ...


def planned_next(
    parts: Mapping[str, Told], names: Iterable[str], player: Player[Wave], stage: Stage, progress: Progress
) -> tuple[dict[str, Any], dict[str, Wave]]:
    """What metrics.json says of the records of a family by `names`, and the waves of those that are taken."""
    waves, added = _taken(parts, names, player, stage, progress)
    expected = {part: now.expected(added[part]).named(part) for part, now in parts.items()}
    gains = {name: sum(each.gains[name] for each in expected.values()) for name in waves}
    affected = cache(lambda part, place: player.affected(part, parts[part].effects.candidates[place]))

    def played(part: str, pair: Pair, name: str) -> dict[str, float] | None:
        progress(f"{name} with {pair.names[0]} on")
        logs = affected(part, pair.places[0]).log(waves[name])
        return None if logs is None else parts[part].played(pair, logs[part])

    found = {
        names: check
        for part, each in expected.items()
        for names, check in checks(each.alike, gains, partial(played, part), stage).items()
    }
    alike = sorted((pair for each in expected.values() for pair in each.alike), key=lambda pair: -pair.cosine)
    unseen = [number for each in expected.values() for number in each.unseen]
    metrics = plan_metrics(alike, unseen, gains, {name: wave.row for name, wave in waves.items()}, found)
    left_out = [part + name for part, now in parts.items() for name in not_simulated(now.effects, now.now)]
    return metrics | {"not_compared": left_out}, waves


def _taken(
    parts: Mapping[str, Told], names: Iterable[str], player: Player[Wave], stage: Stage, progress: Progress
) -> tuple[dict[str, Wave], dict[str, dict[str, np.ndarray]]]:
    """The records that are taken, and the information that each adds, by part and record."""
    waves: dict[str, Wave] = {}
    added: dict[str, dict[str, np.ndarray]] = {part: {} for part in parts}
    for name in names:

        def compute(name: str = name) -> Kept:
            taken = player.takes(name)
            if taken is None:
                return {}
            kept, logs = taken
            windows = {part: windows_of(now.fitted.problem, logs[part]) for part, now in parts.items()}
            return {"kept": kept, **{f"of {part}": parts[part].effects.of_further(windows[part]) for part in parts}}

        progress(f"{name}: in simulation")
        if stored := stage(f"record-{name}", compute):
            waves[name] = player.made(name, stored["kept"])
            for part, own in added.items():
                own[name] = stored[f"of {part}"]
    return waves, added


def wave_files(metrics: Mapping[str, Any], waves: Mapping[str, PlannedRecord | PlannedMotion]) -> dict[str, str]:
    """The files of the records that are best for something."""
    return {row["file"]: waves[row["record"]].text for row in metrics["records"]}


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
        player = _JackPlayer(now.fitted.rig, now.fitted.problem.train.names)
        metrics, records = planned_next({"": now}, family(player.rig), player, stage, progress)

    def draw() -> tuple[Page, Figure]:
        return plan_page(now.fitted.problem, now.effects.candidates, metrics, records)

    return Outcome(metrics, draw, _tables(metrics, records), wave_files(metrics, records), Subject(rig))


@dataclass(frozen=True, eq=False)
class _JackPlayer:
    """The drive of a rig, which logs the signals `names`."""

    rig: Rig
    names: tuple[str, ...]

    @cached_property
    def ready(self) -> DriveSimulation:
        return drive(self.rig)

    def takes(self, name: str) -> tuple[Kept, Logs] | None:
        record = planned(self.ready, name, family(self.rig)[name])
        logs = record and self.log(record)
        if record is None or logs is None:
            return None
        reference, command = record.played.reference, record.played.command
        if self.rig.inner:  # of which the reference alone can be written
            reference, command = reference + command * self.rig.inner.full_command, np.zeros(command.size)
        return {"reference": reference, "command": command}, logs

    def made(self, name: str, kept: Kept) -> PlannedRecord:
        return PlannedRecord(name, family(self.rig)[name], Excitation(name, self.rig.period.value, **kept))

    def affected(self, part: str, candidate: Candidate) -> "_JackPlayer":
        return _JackPlayer(with_effect(self.rig, candidate), self.names)

    def log(self, wave: PlannedRecord) -> Logs | None:
        try:
            ready = self.ready
        except InputError:  # it has no rest with such an effect
            return None
        record = simulated(ready, wave.played, self.names)
        return None if record is None else {"": record}


def _tables(metrics: Mapping[str, Any], records: Mapping[str, PlannedRecord]) -> dict[str, dict[str, np.ndarray]]:
    """What is to be played, by file."""
    waves = {row["record"]: records[row["record"]].played for row in metrics["records"]}
    return {
        name: {"t [s]": wave.t, "reference [m]": wave.reference, "command [1]": wave.command}
        for name, wave in waves.items()
    }
