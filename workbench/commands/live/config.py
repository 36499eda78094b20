"""Step, tune and bench experiments as loops to show: controllers of one signal on the rigs of a set."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...base.table import ConfigTable
from ...loop.rig_variations import variation
from ...loop.scenarios import Limits
from ...loop.tuning.problem import Searched
from ...rigs.rig import Rig
from ..common.bench_experiment import BenchConfig
from ..common.declared import load_one
from ..common.experiment import rig_name
from ..common.step_experiment import StepConfig
from ..tune.options import TuneConfig

RIGS = ("nominal", "mass-50", "mass+50", "beta-50", "supply-20")  # of a jack whose experiment names no set


@dataclass(frozen=True)
class LiveConfig:
    """Loops to show: those of `steps`, on `rigs` by name, the nominal one first.

    `rig_name` is the rig as it was named, `limits` what goals ask for, `searched` the ranges of a tune experiment.
    """

    name: str
    steps: StepConfig
    rig_name: str
    rigs: Mapping[str, Rig]
    limits: Limits = field(default_factory=Limits)
    searched: tuple[Searched, ...] = ()

    @property
    def source(self) -> Mapping[str, Any]:
        """The experiment file as it was read."""
        return self.steps.source


def load_live(path: str | Path) -> LiveConfig:
    """Read the experiment. Of a bench, the loops of the position, where it has any. Raises InputError."""
    name, config = Path(path).stem, load_one((StepConfig, TuneConfig, BenchConfig), path)
    if isinstance(config, TuneConfig):
        return LiveConfig(name, config.start, config.rig_name, config.rigs, config.limits, config.searched)
    named = rig_name(ConfigTable(config.source, name))
    if isinstance(config, StepConfig):
        return LiveConfig(name, config, named, _usual_rigs(config.rig))
    loop = config.loops[0]
    own = {key: getattr(loop, key) for key in ("rig", "signal", "controllers", "scenarios", "bode")}
    steps = StepConfig(**own, conditions=config.conditions, source=config.source)
    return LiveConfig(name, steps, named, loop.rigs)


def _usual_rigs(rig: Rig) -> dict[str, Rig]:
    return {name: variation(rig, name) for name in (RIGS if rig.is_jack else RIGS[:1])}
