"""An experiment on two rigs: the declared one, for which its controller was made, and the one that was found."""

from dataclasses import dataclass
from pathlib import Path

from ...loop.sensors import check_sensors
from ...rigs.rig import Rig
from ..common.experiment import rig_of
from ..common.experiment_file import read_experiment
from ..tune.options import TuneConfig
from .searchable import searchable


@dataclass(frozen=True)
class RetuneConfig:
    """One search on both rigs, each with the experiment's variations about it. The start is the old controller."""

    declared: TuneConfig
    found: TuneConfig


def load_retune(
    path: str | Path,
    found: str | Rig,
    rig: str | None = None,
    controller: str | None = None,
    designs: int | None = None,
) -> RetuneConfig:
    """Read an experiment of tune, run or bench, and the rig `found`, a file or a Rig; `rig` replaces the declared one.

    `controller`: which of several. `designs`: others than the experiment's. Raises InputError with file and key, and
    for a rig that cannot play the scenarios or lacks a sensor.
    """
    path = Path(path)
    top = read_experiment(path)
    table = searchable(top, path, rig_of(top, path, rig), controller)
    configs = [TuneConfig.of(table, path, each, designs=designs) for each in (rig, found)]
    for config in configs:
        spec = config.start.controllers[0]
        check_sensors(config.start.rig, spec.build(config.start.rig.period.value).measures)
    return RetuneConfig(*configs)
