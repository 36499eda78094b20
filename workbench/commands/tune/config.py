"""Tune experiments: a step experiment of one controller, some numbers of which are searched."""

import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.errors import echo
from ...base.table import ConfigTable, TableLocation
from ...loop.scenarios import Limits
from ...loop.tuning.problem import Searched, TuneProblem
from ...rigs.rig import Rig
from ..common.envelope_keys import read_factors, read_limits, read_positions
from ..common.experiment import read_experiment, rig_name, rig_of
from ..common.rig_sets import check_variations, read_rig_set
from ..common.scenario_tables import check_scenarios
from ..common.step_experiment import StepConfig, step_config

_OF_THE_SEARCH = ("rigs", "variation", "weights", "trials", "positions", "draw", "goals", "seeds", "network")
WEIGHTS = {"settling": "1/s", "iae": "1/s", "overshoot": "1/%", "robustness": "1"}


@dataclass(frozen=True)
class TuneConfig:
    """What is searched, and what for: `start` is the step experiment whose one controller has the start's numbers.

    `rig_name` is the rig as it was named, `rigs` are those of the set by name, nominal first; `weights` are those of
    WEIGHTS, in the units there. `seed` is that of the search and of the sensors' noise. `positions`, `factors` and
    `limits`: see TuneProblem.
    """

    start: StepConfig
    rig_name: str
    searched: tuple[Searched, ...]
    rigs: Mapping[str, Rig]
    weights: Mapping[str, float]
    trials: int
    seed: int
    positions: tuple[float, ...]
    factors: Mapping[str, tuple[float, float]]
    limits: Limits
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
        space = start.conditions, self.positions, self.factors, self.limits
        return TuneProblem(start.rig, start.controllers[0], self.searched, start.scenarios, *choice, *space)

    @property
    def _controller(self) -> Mapping[str, Any]:
        return self.source["controllers"][self.name]


def load_tune(path: str | Path, rig: str | None = None) -> TuneConfig:
    """Read a tune experiment; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    if (kind := top.text("experiment")) != "tune":
        other = "bench" if kind == "bench" else "run"
        raise top.complaint("experiment", f'{echo(kind)} is not "tune"; jackbench {other} takes it')
    return tune_config(top, rig or rig_name(top), rig_of(top, path, rig))


def tune_config(top: ConfigTable, named: str, rig: Rig, further: tuple[Searched, ...] = ()) -> TuneConfig:
    """The tables of a tune experiment on a rig, which was `named` so. Raises InputError.

    `further`: weights of a network that are searched besides the numbers with low and high.
    """
    tables = top.optional_table("controllers")
    if len(tables) != 1:
        raise top.complaint("controllers", "tunes one controller; give it one table [controllers.NAME]")
    (name,) = tables
    controller = tables.table(name)
    searched = (*_searched(controller, ()), *further)
    if not searched:
        raise controller.error("nothing is searched; give a number low and high")
    for key in ("low", "high", "start"):  # the ends are numbers that the controller may have
        values = {number.name: getattr(number, key) for number in searched}
        filled = _filled(controller.values, searched, values)
        start = step_config(top.replaced(_step_table(top.values, name, filled)), rig)
    weights = top.optional_table("weights")
    return TuneConfig(
        start,
        named,
        searched,
        _rigs(top, start),
        read_weights(weights.values, weights.place),
        top.count("trials"),
        top.count("seed", 0),
        read_positions(top),
        read_factors(top, start.rig),
        read_limits(top),
        top.values,
    )


def _step_table(table: Mapping[str, Any], name: str, controller: Mapping[str, Any]) -> dict[str, Any]:
    """The step experiment in a tune experiment's table."""
    rest = {key: entry for key, entry in table.items() if key not in (*_OF_THE_SEARCH, "plant")}
    return {**rest, "experiment": "step", "controllers": {name: dict(controller)}}


def _filled(table: Mapping[str, Any], searched: tuple[Searched, ...], values: Mapping[str, float]) -> Mapping[str, Any]:
    """A controller's table with numbers in the place of what is searched."""
    whole = deepcopy(dict(table))
    for number in (number for number in searched if not number.is_weight):
        part: Any = whole
        for key in number.path[:-1]:
            part = part[key]
        part[number.path[-1]] = {"value": values[number.name], "unit": number.unit}
    return whole


def _searched(table: ConfigTable, path: tuple[str | int, ...]) -> list[Searched]:
    """Every number with an end in a controller's table and in its compensators'."""
    searched = []
    for key, entry in table.values.items():
        if key == "compensators":
            for i, part in enumerate(table.tables(key)):
                searched += _searched(part, (*path, key, i))
        elif isinstance(entry, Mapping) and {"low", "high", "log"} & entry.keys():
            if key == "computing_delay":
                raise table.complaint(key, 'is measured, not searched; write {value = ..., unit = "ms"}')
            searched.append(_range(table.table(key, "value", "low", "high", "unit", "log"), (*path, key)))
    return searched


def _range(entry: ConfigTable, path: tuple[str | int, ...]) -> Searched:
    low, high, unit, log = entry.number("low"), entry.number("high"), entry.text("unit"), entry.flag("log", False)
    if not low < high or (log and low <= 0):
        raise entry.error(f"low must be below high{', and above 0 for log' if log else ''}")
    start = entry.number("value", math.sqrt(low * high) if log else (low + high) / 2)
    if not low <= start <= high:
        raise entry.error(f"value {start:g} must be from low to high")
    return Searched(path, unit, low, high, start, log)


def _rigs(top: ConfigTable, start: StepConfig) -> dict[str, Rig]:
    if top.words("rigs", "nominal")[0] != "nominal":
        raise top.complaint("rigs", 'must be a list of different names, "nominal" first')
    rigs = read_rig_set(top, "rigs", top, start.rig)
    check_variations(top, rigs)
    for name, rig in rigs.items():
        if rig.kind != start.rig.kind:
            raise top.complaint("rigs", f"{name} differs in more than numbers; a search takes one kind of rig")
    check_scenarios(top, start.scenarios, rigs.values())
    return rigs


def read_weights(weights: Mapping[str, Any], place: TableLocation | str) -> dict[str, float]:
    """The weights of the cost, one or more, each in the unit of WEIGHTS. Raises InputError, opened by `place`."""
    table = ConfigTable(weights, place, *WEIGHTS)
    if not len(table):
        raise table.error(f"missing; give some of {', '.join(f'{k} [{u}]' for k, u in WEIGHTS.items())}")
    return {key: table.positive(key, WEIGHTS[key]) for key in table}
