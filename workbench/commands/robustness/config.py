"""The file of a robustness experiment: controllers, a step, and how far the rig's numbers are drawn."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.signals import Signal
from ...base.table import ConfigTable
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec, controller_spec
from ...loop.rig_variations import ALL, known_to
from ...loop.robustness.problem import RobustnessProblem
from ...rigs.rig import Rig
from ..common.envelope_keys import MOST_PLANTS, read_factors, read_moves, read_positions
from ..common.experiment import (
    borrowed_controllers,
    on_platform,
    read_conditions,
    read_experiment,
    rig_of,
    with_specimen,
)
from .platform_config import PlatformRobustness, platform_robustness

KEYS = (
    "experiment", "rig", "plant", "specimen", "plants", "seed", "ideal", "step", "seconds", "moves", "stroke",
    "positions", "known", "from", "draw",
)  # fmt: skip
_STEPS = {"m": (1e-6, 1.0), "N": (1.0, 1e9)}  # by the SI unit of the signal
_ANY_STEP = 1e-12, 1e12


@dataclass(frozen=True, kw_only=True)
class RobustnessConfig(RobustnessProblem):
    """The same of an experiment; `source` is that as it was read, with the tables of its controllers."""

    source: Mapping[str, Any]


def load_any(
    path: str | Path, rig: str | None = None, plants: int | None = None
) -> RobustnessConfig | PlatformRobustness:
    """Read the file, of one jack or of a platform; `rig` and `plants` replace what it says. Raises InputError with
    file, line and key."""
    path = Path(path)
    top = read_experiment(path)
    if on_platform(top, path, rig):
        return platform_robustness(top, path, rig, plants)
    return load_robustness(path, rig, plants)


def load_robustness(path: str | Path, rig: str | None = None, plants: int | None = None) -> RobustnessConfig:
    """Read the file; `rig` and `plants` replace what it says. Raises InputError with file, line and key."""
    path = Path(path)
    table = read_experiment(path)
    if "computing_delay" in table:
        raise table.complaint("computing_delay", "the rig or a controller says it, here only ideal = true; remove it")
    table.word("experiment", ["robustness"])
    table.allow(*KEYS)
    nominal = rig_of(table, path, rig)
    if "specimen" in table:
        nominal = with_specimen(nominal, table.table("specimen"))
    tables = borrowed_controllers(table.table("from"), path.parent)
    controllers = tuple(controller_spec(name, part).knowing(nominal) for name, part in tables.items())
    signal = _signal(table, controllers, nominal)
    source = {**table.values, "controllers": {name: part.values for name, part in tables.items()}}
    return read_drawn_steps(table, nominal, signal, controllers, plants, source)


def read_drawn_steps(
    table: ConfigTable,
    nominal: Rig,
    signal: Signal,
    controllers: tuple[ControllerSpec, ...],
    plants: int | None,
    source: Mapping[str, Any],
) -> RobustnessConfig:
    """The step and the drawn plants of a file. Raises InputError with file, line and key."""
    stroke = table.positive("stroke")
    if stroke > 1:
        raise table.complaint("stroke", "a share of the stroke limit, at most 1")
    rig, factors = nominal, read_factors(table, nominal)
    if "known" in table:
        rig, factors = known_to(rig, factors, _known(table))
    return RobustnessConfig(
        rig=rig,
        plants=plants or table.count("plants", 1, MOST_PLANTS),
        conditions=read_conditions(table),
        signal=signal,
        step=table.quantity("step", Spec(signal.si, *_STEPS.get(signal.si, _ANY_STEP), "size of the step")),
        seconds=table.quantity("seconds", Spec("s", 0.5, 60.0, "how long it is watched")),
        stroke=stroke,
        positions=read_positions(table),
        factors=factors,
        controllers=controllers,
        source=source,
        moves=read_moves(table),
    )


def _known(table: ConfigTable) -> float:
    """The share of its range to which each number is known, either way."""
    known = table.positive("known", "%")
    if known > ALL:
        raise table.complaint("known", f"at most {ALL:g}: to +- so many percent of its range each number is known")
    return known / 100


def _signal(table: ConfigTable, controllers: tuple[ControllerSpec, ...], rig: Rig) -> Signal:
    """The signal that all controllers control. Raises InputError for different ones, or a force on nothing."""
    names = [spec.build(rig.period.value).measures[0] for spec in controllers]
    for spec, name in zip(controllers, names, strict=True):
        if name != names[0]:
            what = f"{spec.name} controls the {name}, {controllers[0].name} the {names[0]}; make two experiments"
            raise table.complaint("from", what)
    if names[0] == "force" and not rig.specimen_stiffness:
        raise table.complaint("specimen", "a force needs something to act on; add a table [specimen]")
    return rig.signal(names[0])
