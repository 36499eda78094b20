"""The file of a learning experiment on a platform: a motion, what measures the loop, payloads that are drawn."""

from dataclasses import dataclass
from pathlib import Path

from ...base.table import ConfigTable
from ...base.units import Spec
from ...control.platform_controller import PlatformSpec
from ...loop.platform.learning import PayloadDraw
from ...records.excitation import MultisineSpec
from ..common.envelope_keys import draws_nothing, read_ends
from ..common.platform_experiment import PlatformExperiment, platform_experiment
from ..common.platform_motion import MOTION, PlatformMotion, read_motion
from ..common.record_experiment import read_multisine

_MOST_PLANTS = 1000
_AMPLITUDE = Spec("m", 1e-6, 1.0, "largest deviation at the joints")
_KEYS = ("experiment", "rig", "controllers", "record", "measure", "iterations", "plants", "draw", "ideal", "seed")


@dataclass(frozen=True, kw_only=True)
class PlatformRecordExperiment(PlatformExperiment):
    """A platform and its one controller, and the payloads drawn for it; None without."""

    drawn: PayloadDraw | None


@dataclass(frozen=True)
class PlatformLearnConfig:
    """A motion that a controller repeats at most so often; the filter is that of the declared payload, measured."""

    record: PlatformRecordExperiment
    motion: PlatformMotion
    controller: PlatformSpec
    sines: MultisineSpec
    iterations: int


def platform_learning(top: ConfigTable, path: Path, rig: str | None, plants: int | None) -> PlatformLearnConfig:
    """The tables of such an experiment; `rig` and `plants` replace what they say. Raises InputError."""
    top.word("experiment", ["learn"])
    top.allow(*_KEYS)
    shared = platform_experiment(top, path, rig)
    controller, *more = shared.controllers
    if more:
        raise top.complaint("controllers", f"{1 + len(more)} of them; name one")
    record = PlatformRecordExperiment(**vars(shared), drawn=_drawn(top, plants))
    motion = read_motion(top.table("record", *MOTION), shared.rig)
    sines = read_multisine(top.table("measure"), _AMPLITUDE, 0.5 / shared.rig.period, 1.0)
    return PlatformLearnConfig(record, motion, controller, sines, top.count("iterations"))


def _drawn(top: ConfigTable, plants: int | None) -> PayloadDraw | None:
    if draws_nothing(top, plants, "draw"):
        return None
    table = top.table("draw", "mass", "inertia", "centre")
    return PayloadDraw(
        plants or top.count("plants", 1, _MOST_PLANTS),
        read_ends(table, "mass"),
        read_ends(table, "inertia"),
        table.quantity("centre", Spec("m", 0.0, 10.0, "how far the centre of mass may be along each axis")),
    )
