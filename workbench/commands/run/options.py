"""`jackbench run EXPERIMENT`: experiments of several kinds."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ...control.controller_spec import read_numbers
from ...control.protocol import design_numbers, number
from ...rigs.rig import Rig
from ..common.declared import Experiment, ExperimentFile, count, declared, load_one, part, takes_experiment
from ..common.experiment import MOST_POINTS, asked_rig
from ..common.step_experiment import StepConfig
from .automatic_config import AutomaticConfig
from .platform_config import PlatformConfig

if TYPE_CHECKING:
    from ...identify.datasheet.corrector import Maker

_THREE_STAGES = {"rig": "one with a three-stage valve"}


def _three_stages(at: ExperimentFile) -> Rig:
    rig = asked_rig(at)
    if not rig.valve_kind.has_pilot:
        raise at.top.complaint("rig", f"{rig.name} has no three-stage valve, which is what the paper is about")
    return rig


@declared
class PaperConfig(Experiment):
    """The paper's figures on a rig: `points` frequencies per curve before the corners are refined."""

    KIND = "paper"
    rig: Rig = part(_three_stages, _THREE_STAGES)
    points: int = count(5, MOST_POINTS, "frequencies of a curve")


@design_numbers
class Corners:
    """The frequencies at which a maker's curve has fallen by 3 dB and is 90 degrees late."""

    f3db: float = number("Hz", 1.0, 1e4, "-3 dB")
    f90: float = number("Hz", 1.0, 1e4, "-90 deg")


def _maker(at: ExperimentFile) -> "Maker":
    from ...identify.datasheet.corrector import Maker

    maker = at.top.table("maker")
    peak = maker.numbers("peak_db", "[1.0, 2.0]")
    if len(peak) != 2 or not peak[0] <= peak[1]:
        raise maker.complaint("peak_db", "write the least and the most, such as [1.0, 2.0]")
    numbers = maker.replaced({key: entry for key, entry in maker.values.items() if key != "peak_db"})
    corners = read_numbers(Corners, numbers)
    return Maker(corners.f3db, corners.f90, (peak[0], peak[1]))


@declared
class CorrectorConfig(Experiment):
    """Correctors in the spool loop, fitted to a maker's curve."""

    KIND = "corrector"
    rig: Rig = part(_three_stages, _THREE_STAGES)
    maker: "Maker" = part(_maker, {"maker": "corners and peak of the maker's curve"})
    current_limit: float = part(
        lambda at: at.top.positive("current_limit"), {"current_limit": "largest current over the rated one"}
    )
    least_damping: float = part(
        lambda at: at.top.positive("least_damping"), {"least_damping": "least damping ratio at null"}
    )
    points: int = count(5, MOST_POINTS, "frequencies of a curve")


Config = PaperConfig | StepConfig | CorrectorConfig | PlatformConfig | AutomaticConfig
_KINDS = (PaperConfig, StepConfig, CorrectorConfig, PlatformConfig, AutomaticConfig)


def load_config(path: str | Path, rig: str | None = None) -> Config:
    """Read an experiment file; `rig` replaces the one it names. Raises InputError with file and key."""
    return load_one(_KINDS, path, rig)


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    takes_experiment(
        parser, "an experiment file, such as experiments/paper.toml", PaperConfig, "run.study:run_any", load_config
    )
