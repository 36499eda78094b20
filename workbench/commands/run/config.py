"""Experiment files: TOML into typed, frozen configurations. A key that is not known names its nearest neighbour."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.table import ConfigTable
from ...control.controller_spec import read_numbers
from ...control.protocol import design_numbers, number
from ...rigs.rig import Rig
from ..common.experiment import MOST_POINTS, read_experiment, rig_of
from ..common.step_experiment import StepConfig, step_config
from .automatic_config import AutomaticConfig, automatic_config
from .platform_config import PlatformConfig, platform_config

if TYPE_CHECKING:
    from ...identify.datasheet.corrector import Maker


@dataclass(frozen=True)
class PaperConfig:
    """The paper's figures on a rig: `points` frequencies per curve before the corners are refined.

    `source` is the experiment file as it was read.
    """

    rig: Rig
    points: int
    source: Mapping[str, Any]


@design_numbers
class Corners:
    """Where a maker's curve has fallen by 3 dB, and where it is 90 degrees late."""

    f3db: float = number("Hz", 1.0, 1e4, "-3 dB")
    f90: float = number("Hz", 1.0, 1e4, "-90 deg")


@dataclass(frozen=True)
class CorrectorConfig:
    """Correctors in the spool loop, fitted to a maker's curve: `current_limit` over the rated current, least damping
    ratio at null, points per curve."""

    rig: Rig
    maker: "Maker"
    current_limit: float
    least_damping: float
    points: int
    source: Mapping[str, Any]


Config = PaperConfig | StepConfig | CorrectorConfig | PlatformConfig | AutomaticConfig


def load_config(path: str | Path, rig: str | None = None) -> Config:
    """Read an experiment file; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    if (kind := top.text("experiment")) in ("tune", "bench", "learn", "inverse"):
        raise top.complaint("experiment", f'"{kind}"; jackbench {kind} takes it')
    kinds = {"paper": _paper, "step": step_config, "corrector": _corrector, "automatic": automatic_config}
    if (kind := top.word("experiment", (*kinds, "platform"))) == "platform":
        return platform_config(top, path, rig)
    return kinds[kind](top, rig_of(top, path, rig))


def _paper(top: ConfigTable, rig: Rig) -> PaperConfig:
    top.allow("experiment", "rig", "points")
    _three_stages(top, rig)
    return PaperConfig(rig, top.count("points", 5, MOST_POINTS), top.values)


def _three_stages(top: ConfigTable, rig: Rig) -> None:
    if not rig.valve_kind.has_pilot:
        raise top.complaint("rig", f"{rig.name} has no three-stage valve, which is what the paper is about")


def _corrector(top: ConfigTable, rig: Rig) -> CorrectorConfig:
    from ...identify.datasheet.corrector import Maker

    top.allow("experiment", "rig", "points", "current_limit", "least_damping", "maker")
    _three_stages(top, rig)
    maker = top.table("maker")
    peak = maker.numbers("peak_db", "[1.0, 2.0]")
    if len(peak) != 2 or not peak[0] <= peak[1]:
        raise maker.complaint("peak_db", "write the least and the most, such as [1.0, 2.0]")
    numbers = maker.replaced({key: entry for key, entry in maker.values.items() if key != "peak_db"})
    corners = read_numbers(Corners, numbers)
    return CorrectorConfig(
        rig,
        Maker(corners.f3db, corners.f90, (peak[0], peak[1])),
        top.positive("current_limit"),
        top.positive("least_damping"),
        top.count("points", 5, MOST_POINTS),
        top.values,
    )
