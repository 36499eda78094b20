"""Experiment files: TOML into typed, frozen configurations. A key that is not known names its nearest neighbour."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import InputError, nearest
from .recipe import Recipe, recipe
from .rig import Rig, load_rig
from .scenario import Scenario, scenario
from .toml import check_keys, read_toml


@dataclass(frozen=True)
class PaperConfig:
    """The paper's figures on a rig: `points` frequencies per curve before the corners are refined.

    `source` is the experiment file as it was read.
    """

    rig: Rig
    points: int
    source: Mapping[str, Any]


@dataclass(frozen=True)
class BodeConfig:
    """Closed-loop Bode by stepped sine: range [Hz], number of points, amplitudes of the reference (SI)."""

    low: float
    high: float
    points: int
    amplitudes: tuple[float, ...]


@dataclass(frozen=True)
class StepConfig:
    """Steps of a loop: controllers x scenarios on a rig, with its closed-loop Bode."""

    rig: Rig
    controllers: tuple[Recipe, ...]
    scenarios: tuple[Scenario, ...]
    bode: BodeConfig
    source: Mapping[str, Any]


Config = PaperConfig | StepConfig


def load_config(path: str | Path, rig: str | None = None) -> Config:
    """Read an experiment file; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    table = read_toml(path)
    kinds = {"paper": _paper, "step": _step}
    kind = table.get("experiment")
    if kind not in kinds:
        raise InputError(f'{path}: experiment = "{kind}": {nearest(str(kind), kinds)}')
    where = str(path)
    named = rig or table.get("rig")
    if not isinstance(named, str):
        raise InputError(f'{path}: rig is missing; write rig = "jack-10t" or the path of a rig file')
    return kinds[kind](table, load_rig(named, None if rig else path.parent), where)


def _paper(table: Mapping[str, Any], rig: Rig, where: str) -> PaperConfig:
    check_keys(table, ("experiment", "rig", "points"), where)
    if rig.valve != "three-stage":
        raise InputError(f"{where}: rig {rig.name} has no three-stage valve, which is what the paper is about")
    return PaperConfig(rig, _count(table, "points", where, 5), table)


def _step(table: Mapping[str, Any], rig: Rig, where: str) -> StepConfig:
    check_keys(table, ("experiment", "rig", "scenarios", "controllers", "bode"), where)
    controllers = table.get("controllers")
    if not isinstance(controllers, Mapping) or not controllers:
        raise InputError(f"{where}: no controllers; add a table [controllers.NAME]")
    names = table.get("scenarios")
    if not isinstance(names, list) or not names:
        raise InputError(f'{where}: no scenarios; write scenarios = ["position-10mm"]')
    return StepConfig(
        rig,
        tuple(
            recipe(name, _table(part, f"{where}: [controllers.{name}]"), f"{where}: [controllers.{name}]")
            for name, part in controllers.items()
        ),
        tuple(scenario(str(name), f"{where}: scenarios") for name in names),
        _bode(_table(table.get("bode"), f"{where}: [bode]"), f"{where}: [bode]"),
        table,
    )


def _bode(table: Mapping[str, Any], where: str) -> BodeConfig:
    check_keys(table, ("low_hz", "high_hz", "points", "amplitudes_mm"), where)
    low, high = _positive(table.get("low_hz"), f"{where}: low_hz"), _positive(table.get("high_hz"), f"{where}: high_hz")
    if not low < high:
        raise InputError(f"{where}: low_hz must be below high_hz")
    amplitudes = table.get("amplitudes_mm")
    if not isinstance(amplitudes, list) or not amplitudes:
        raise InputError(f"{where}: amplitudes_mm must be a list of numbers")
    sizes = tuple(_positive(value, f"{where}: amplitudes_mm") * 1e-3 for value in amplitudes)
    return BodeConfig(low, high, _count(table, "points", where, 3), sizes)


def _table(value: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(f"{where}: this table is missing; add it")
    return value


def _positive(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < float("inf"):
        raise InputError(f"{where} = {value}: must be a positive number")
    return float(value)


def _count(table: Mapping[str, Any], key: str, where: str, least: int) -> int:
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InputError(f"{where}: {key} = {value}: must be a whole number, {least} or more")
    return value
