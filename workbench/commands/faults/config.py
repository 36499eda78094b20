"""The file of a faults experiment: controllers, the steps in which faults begin, and plants without a fault."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.table import ConfigTable
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec, controller_spec
from ...loop.fault_trial import FaultLoops, FaultTrials
from ...rigs.rig import Rig
from ..common.envelope_keys import read_factors
from ..common.experiment import borrowed_controllers, read_conditions, read_experiment, rig_of, with_specimen

_KEYS = ("experiment", "rig", "specimen", "plants", "seed", "steps", "stroke", "seconds", "from", "draw")
_STEPS = {"position": Spec("m", 1e-6, 1.0, "step of position"), "force": Spec("N", 1.0, 1e9, "step of force")}


@dataclass(frozen=True)
class FaultsConfig(FaultTrials):
    """The trials of an experiment; `source` is the experiment as it was read."""

    source: Mapping[str, Any]


def load_faults(path: str | Path, rig: str | None = None, plants: int | None = None) -> FaultsConfig:
    """Read the file; `rig` and `plants` replace what it says. Raises InputError with file, line and key."""
    path = Path(path)
    table = read_experiment(path)
    table.word("experiment", ["faults"])
    table.allow(*_KEYS)
    nominal = rig_of(table, path, rig)
    if not nominal.is_jack:
        raise table.complaint("rig", "has no chambers, so that the guard has limits only; name a jack")
    tables = borrowed_controllers(table.table("from"), path.parent)
    specs = [controller_spec(name, part).knowing(nominal) for name, part in tables.items()]
    stroke = table.positive("stroke")
    if stroke > 1:
        raise table.complaint("stroke", "a share of the stroke limit, at most 1")
    return FaultsConfig(
        rig=nominal,
        loops=tuple(_loops(table, nominal, signal, specs) for signal in _signals(specs, nominal)),
        plants=plants or table.count("plants"),
        stroke=stroke,
        seconds=table.quantity("seconds", Spec("s", 0.2, 10.0, "how long a loop is watched")),
        conditions=read_conditions(table),
        source={**table.values, "controllers": {name: part.values for name, part in tables.items()}},
    )


def _signals(specs: list[ControllerSpec], rig: Rig) -> list[str]:
    """The controlled signals, position first."""
    return sorted({spec.build(rig.period.value).measures[0] for spec in specs}, reverse=True)


def _loops(table: ConfigTable, nominal: Rig, signal: str, specs: list[ControllerSpec]) -> FaultLoops:
    steps = table.table("steps", *_STEPS)
    rig = nominal
    if signal == "force":
        rig = with_specimen(nominal, table.table("specimen"))
    own = tuple(spec for spec in specs if spec.build(rig.period.value).measures[0] == signal)
    return FaultLoops(signal, rig, steps.quantity(signal, _STEPS[signal]), read_factors(table, rig), own)
