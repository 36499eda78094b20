"""Step, tune and bench experiments as loops to show: controllers of one signal on the rigs of a set."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...base.errors import echo
from ...base.table import ConfigTable
from ...loop.rig_variations import variation
from ...loop.scenarios import Limits
from ...loop.tuning.problem import Searched
from ...rigs.rig import Rig
from ..common.bench_experiment import load_bench
from ..common.experiment import rig_name
from ..common.experiment_file import read_experiment
from ..common.step_experiment import StepConfig, load_steps
from ..tune.options import load_tune

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
    path = Path(path)
    top = read_experiment(path)
    kind = top.text("experiment")
    if kind == "step":
        steps = load_steps(path)
        return LiveConfig(path.stem, steps, rig_name(top), _usual_rigs(steps.rig))
    if kind == "tune":
        tune = load_tune(path)
        return LiveConfig(path.stem, tune.start, tune.rig_name, tune.rigs, tune.limits, tune.searched)
    if kind == "bench":
        return _of_bench(path, top)
    raise top.complaint("experiment", f'{echo(kind)} has no loop to move; give one of "step", "tune" or "bench"')


def _usual_rigs(rig: Rig) -> dict[str, Rig]:
    return {name: variation(rig, name) for name in (RIGS if rig.is_jack else RIGS[:1])}


def _of_bench(path: Path, top: ConfigTable) -> LiveConfig:
    bench = load_bench(path)
    loop = bench.loops[0]
    steps = StepConfig(
        rig=loop.rig,
        signal=loop.signal,
        controllers=loop.controllers,
        scenarios=loop.scenarios,
        bode=loop.bode,
        conditions=bench.conditions,
        source=bench.source,
    )
    return LiveConfig(path.stem, steps, rig_name(top), loop.rigs)
