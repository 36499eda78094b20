"""The file of a learning experiment on a platform: a motion, what measures the loop, payloads that are drawn."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.table import Table
from ...base.units import Spec
from ...control.platform_controller import PlatformSpec
from ...loop.conditions import Conditions
from ...loop.platform.learning import PayloadDraw
from ...loop.platform.measured import SixSines
from ...rigs.platform import Platform, load_platform
from ..common.experiment import read_conditions
from ..common.platform_controllers import platform_controllers
from ..common.platform_motion import MOTION, PlatformMotion, read_motion

_MOST_PLANTS = 1000
_KEYS = ("experiment", "rig", "controllers", "record", "measure", "iterations", "plants", "draw", "ideal", "seed")


@dataclass(frozen=True)
class PlatformRecordExperiment:
    """The platform, the payloads drawn for it (None without), and the file as it was read."""

    rig: Platform
    drawn: PayloadDraw | None
    source: Mapping[str, Any]


@dataclass(frozen=True)
class PlatformLearnConfig:
    """A motion that a controller repeats at most so often; the filter is that of the declared payload, measured."""

    record: PlatformRecordExperiment
    motion: PlatformMotion
    controller: PlatformSpec
    sines: SixSines
    iterations: int
    conditions: Conditions

    @property
    def delay(self) -> float:
        """Computing delay [s]."""
        return 0.0 if self.conditions.ideal else self.record.rig.legs[0].rig.computing_delay.value


def platform_learning(top: Table, path: Path, rig: str | None, plants: int | None) -> PlatformLearnConfig:
    """The tables of such an experiment; `rig` and `plants` replace what they say. Raises InputError."""
    top.word("experiment", ["learn"])
    top.allow(*_KEYS)
    platform = load_platform(rig) if rig else load_platform(top.text("rig"), path.parent)
    controller, *more = platform_controllers(top, platform)
    if more:
        raise top.complaint("controllers", f"{1 + len(more)} of them; name one")
    record = top.table("record", *MOTION)
    return PlatformLearnConfig(
        PlatformRecordExperiment(platform, _drawn(top, plants), top.values),
        read_motion(record, platform),
        controller,
        _sines(top.table("measure"), platform),
        top.count("iterations"),
        read_conditions(top),
    )


def _sines(table: Table, platform: Platform) -> SixSines:
    table.allow("amplitude", "low", "high", "seconds", "lines")
    nyquist = 0.5 / platform.period
    low, high = (table.quantity(key, Spec("Hz", 1e-3, nyquist, f"{key}est frequency")) for key in ("low", "high"))
    return SixSines(
        table.quantity("amplitude", Spec("m", 1e-6, 1.0, "largest deviation at the joints")),
        (low, high),
        table.quantity("seconds", Spec("s", 1.0, 100.0, "one period of the multisines")),
        table.count("lines", 2),
    )


def _drawn(top: Table, plants: int | None) -> PayloadDraw | None:
    if "plants" not in top:
        if "draw" in top:
            raise top.complaint("draw", "of drawn payloads; say how many under `plants`")
        if plants:
            raise top.complaint("plants", "missing: the experiment draws none, and --plants cannot say how; add it")
        return None
    table = top.table("draw", "mass", "inertia", "centre")
    return PayloadDraw(
        plants or top.count("plants", 1, _MOST_PLANTS),
        _factors(table, "mass"),
        _factors(table, "inertia"),
        table.quantity("centre", Spec("m", 0.0, 10.0, "how far the centre of mass may be along each axis")),
    )


def _factors(table: Table, key: str) -> tuple[float, float]:
    """The least and the largest factor."""
    ends = table.numbers(key, "[0.75, 1.25]")
    if len(ends) != 2 or not 0 < ends[0] <= ends[1]:
        raise table.complaint(key, "write the least and the largest factor, such as [0.75, 1.25]")
    return ends[0], ends[1]
