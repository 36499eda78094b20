"""Tune experiments: a step experiment of one controller, some numbers of which are searched."""

import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.errors import InputError, nearest
from ...base.toml import check_keys
from ...loop.rig_variations import variation
from ...rigs.rig import Rig, load_rig
from ..common.experiment_file import read_experiment
from ..run.config import StepConfig, step_config
from .problem import Searched, TuneProblem

WEIGHTS = {"settling": "1/s", "iae": "1/s", "overshoot": "1/%", "robustness": "1"}


@dataclass(frozen=True)
class TuneConfig:
    """What is searched, and what for: `start` is the step experiment whose one controller has the start's numbers.

    `rig_name` is the rig as it was named, `rigs` are names of the plant set, nominal first; `weights` are those of
    WEIGHTS, in the units there.
    """

    start: StepConfig
    rig_name: str
    searched: tuple[Searched, ...]
    rigs: tuple[str, ...]
    weights: Mapping[str, float]
    trials: int
    seed: int
    source: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Of the controller."""
        return self.start.controllers[0].name

    def step_table(self, values: Mapping[str, float], rig: str) -> dict[str, Any]:
        """The step experiment on a named rig whose controller has these numbers, each in its unit."""
        table = _step_table(self.source, self.name, _filled(self._controller, self.searched, values))
        return {**table, "rig": rig}

    @property
    def problem(self) -> TuneProblem:
        """The search without its file."""
        start, choice = self.start, (self.rigs, self.weights, self.trials, self.seed)
        return TuneProblem(start.rig, start.controllers[0], self.searched, start.scenarios, *choice)

    @property
    def _controller(self) -> Mapping[str, Any]:
        return self.source["controllers"][self.name]


def load_tune(path: str | Path, rig: str | None = None) -> TuneConfig:
    """Read a tune experiment; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    table, where = read_experiment(path), str(path)
    if table.get("experiment") != "tune":
        other = "bench" if table.get("experiment") == "bench" else "run"
        hint = f"jackbench {other} takes it" if table.get("experiment") else 'write experiment = "tune"'
        raise InputError(f'{where}: experiment = "{table.get("experiment")}" is not "tune"; {hint}')
    named = rig or table.get("rig")
    if not isinstance(named, str):
        raise InputError(f'{where}: rig is missing; write rig = "jack-10t" or the path of a rig file')
    return _tune(table, named, load_rig(named, None if rig else path.parent), where)


def _tune(table: Mapping[str, Any], named: str, rig: Rig, where: str) -> TuneConfig:
    controllers = table.get("controllers")
    if not isinstance(controllers, Mapping) or len(controllers) != 1:
        raise InputError(f"{where}: tunes one controller; give it one table [controllers.NAME]")
    (name, controller), *_ = controllers.items()
    if not isinstance(controller, Mapping):
        raise InputError(f"{where}: controllers.{name} must be a table [controllers.{name}]")
    searched = tuple(_searched(controller, (), f"{where}: [controllers.{name}]"))
    if not searched:
        raise InputError(f"{where}: [controllers.{name}]: nothing is searched; give a number low and high")
    for key in ("low", "high", "start"):  # the ends are numbers that the controller may have
        values = {one.name: getattr(one, key) for one in searched}
        chosen = _step_table(table, name, _filled(controller, searched, values))
        start = step_config(chosen, rig, where)
    return TuneConfig(
        start,
        named,
        searched,
        _rigs(table.get("rigs"), start.rig, where),
        read_weights(table.get("weights"), f"{where}: [weights]"),
        _whole(table, "trials", 1, where),
        _whole(table, "seed", 0, where),
        table,
    )


def _step_table(table: Mapping[str, Any], name: str, controller: Mapping[str, Any]) -> dict[str, Any]:
    """The step experiment in a tune experiment's table."""
    rest = {key: entry for key, entry in table.items() if key not in ("rigs", "weights", "trials", "seed")}
    return {**rest, "experiment": "step", "controllers": {name: dict(controller)}}


def _filled(table: Mapping[str, Any], searched: tuple[Searched, ...], values: Mapping[str, float]) -> Mapping[str, Any]:
    """A controller's table with numbers in the place of what is searched."""
    whole = deepcopy(dict(table))
    for one in searched:
        part: Any = whole
        for key in one.path[:-1]:
            part = part[key]
        part[one.path[-1]] = {"value": values[one.name], "unit": one.unit}
    return whole


def _searched(table: Mapping[str, Any], path: tuple[str | int, ...], where: str) -> list[Searched]:
    """Every number with an end in a controller's table and in its compensators'."""
    found = []
    for key, entry in table.items():
        if key == "compensators" and isinstance(entry, list):
            for i, part in enumerate(entry):
                if isinstance(part, Mapping):
                    found += _searched(part, (*path, key, i), f"{where}: compensator {i + 1}")
        elif isinstance(entry, Mapping) and {"low", "high", "log"} & entry.keys():
            found.append(_range(entry, (*path, key), f"{where}: {key}"))
    return found


def _range(entry: Mapping[str, Any], path: tuple[str | int, ...], where: str) -> Searched:
    check_keys(entry, ("value", "low", "high", "unit", "log"), where)
    low, high, log = entry.get("low"), entry.get("high"), entry.get("log", False)
    for end in (low, high, entry.get("value", low)):
        if isinstance(end, bool) or not isinstance(end, int | float) or not math.isfinite(end):
            raise InputError(f"{where}: write {{low = ..., high = ..., unit = ...}} with numbers")
    if not isinstance(log, bool) or not isinstance(entry.get("unit"), str):
        raise InputError(f"{where}: unit must be a text, and log true or false")
    low, high = float(low), float(high)  # pyright: ignore[reportArgumentType]
    if not low < high or (log and low <= 0):
        raise InputError(f"{where}: low must be below high{', and above 0 for log' if log else ''}")
    start = float(entry.get("value", math.sqrt(low * high) if log else (low + high) / 2))
    if not low <= start <= high:
        raise InputError(f"{where}: value {start:g} must be from low to high")
    return Searched(path, entry["unit"], low, high, start, log)


def _rigs(names: Any, rig: Rig, where: str) -> tuple[str, ...]:
    if not isinstance(names, list) or names[:1] != ["nominal"] or len({str(name) for name in names}) != len(names):
        raise InputError(f'{where}: rigs must be a list of different names, "nominal" first')
    for name in names:
        try:
            variation(rig, str(name))
        except InputError as error:
            raise InputError(f"{where}: rigs: {error}") from None
    return tuple(str(name) for name in names)


def read_weights(table: Any, where: str) -> dict[str, float]:
    if not isinstance(table, Mapping) or not table:
        raise InputError(f"{where}: this table is missing; {', '.join(f'{k} [{u}]' for k, u in WEIGHTS.items())}")
    for key, value in table.items():
        if key not in WEIGHTS:
            raise InputError(f'{where}: unknown key "{key}"; {nearest(key, WEIGHTS)}')
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
            raise InputError(f"{where}: {key} = {value}: must be a positive number, in {WEIGHTS[key]}")
    return {key: float(value) for key, value in table.items()}


def _whole(table: Mapping[str, Any], key: str, least: int, where: str) -> int:
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InputError(f"{where}: {key} = {value}: must be a whole number, {least} or more")
    return value
