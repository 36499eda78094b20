"""An experiment on two rigs: the declared one, for which its controller was made, and the one that was found."""

from dataclasses import dataclass, replace
from pathlib import Path

from ...loop.sensors import check_sensors
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig
from ..common.experiment import read_experiment, rig_name, rig_of
from ..tune.config import TuneConfig, tune_config
from .searchable import searchable


@dataclass(frozen=True)
class RetuneConfig:
    """The same search on both rigs, each with the experiment's variations about it. The start is the old controller."""

    declared: TuneConfig
    found: TuneConfig


def load_retune(
    path: str | Path, found: str | Rig, rig: str | None = None, controller: str | None = None, trials: int | None = None
) -> RetuneConfig:
    """Read an experiment of tune, run or bench, and the rig `found`, a file or a Rig; `rig` replaces the declared one.

    `controller`: which of several. `trials`: others than the experiment's. Raises InputError with file and key, and for
    a rig that cannot play the scenarios or lacks a sensor.
    """
    path = Path(path)
    top = read_experiment(path)
    declared = rig_of(top, path, rig)
    table = searchable(top, path, declared, controller)
    name, better = (found.name, found) if isinstance(found, Rig) else (found, load_rig(found))
    configs = [tune_config(table, rig or rig_name(top), declared), tune_config(table, name, better)]
    for config in configs:
        spec = config.start.controllers[0]
        check_sensors(config.start.rig, spec.build(config.start.rig.period.value).measures)
    first, second = (replace(config, trials=trials or config.trials) for config in configs)
    return RetuneConfig(first, second)
