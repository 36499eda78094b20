"""`jackbench tune EXPERIMENT`: a step experiment of one controller, some numbers of which are searched."""

import argparse
import math
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

from ...base.table import ConfigTable, TableLocation
from ...loop.rig_variations import Factors
from ...loop.scenarios import POSITIONS, Limits
from ...loop.tuning.problem import USUAL_WEIGHTS, Searched, TuneProblem, weight_unit
from ...rigs.rig import Rig
from ..common.declared import MANY, Experiment, ExperimentFile, count, declared, meanings, part, takes_experiment
from ..common.envelope_keys import WITHIN, read_factors, read_limits, read_positions
from ..common.experiment import asked_rig, rig_name
from ..common.experiment_file import with_names
from ..common.rig_sets import RIGS, checked_rig_set
from ..common.scenario_tables import check_scenarios
from ..common.step_experiment import StepConfig

_OF_THE_SEARCH = ("rigs", "variation", "weights", "designs", "positions", "within", "goals", "seeds", "network")
_OF_THE_START = {key: text for key, text in meanings(StepConfig).items() if key != "experiment"}


def _named(at: ExperimentFile) -> str:
    rig = at.asked.get("rig")
    return rig_name(at.top) if rig is None else rig if isinstance(rig, str) else rig.name


def searched_numbers(at: ExperimentFile) -> tuple[Searched, ...]:
    """Every number with low and high of the one controller. Raises InputError for several controllers."""
    if len(at.tables) != 1:
        raise at.top.complaint("controllers", "tunes one controller; give it one table [controllers.NAME]")
    return tuple(_searched(next(iter(at.tables.values())), ()))


def _some(at: ExperimentFile) -> tuple[Searched, ...]:
    if not (searched := searched_numbers(at)):
        raise next(iter(at.tables.values())).error("nothing is searched; give a number low and high")
    return searched


def _start(at: ExperimentFile) -> StepConfig:
    """The step experiment of the start; the ends of every range are numbers that the controller may have, too."""
    ((name, controller),) = at.tables.items()
    rig, configs = asked_rig(at), list[StepConfig]()
    for key in ("low", "high", "start"):
        values = {number.name: getattr(number, key) for number in at.searched}
        filled = _filled(controller.values, at.searched, values)
        top = at.top.replaced(_step_table(at.top.values, name, filled))
        configs.append(StepConfig.of(top, at.path, rig))
    return configs[-1]


def _rigs(at: ExperimentFile) -> dict[str, Rig]:
    top, nominal = at.top, at.start.rig
    if top.words("rigs", "nominal")[0] != "nominal":
        raise top.complaint("rigs", 'must be a list of different names, "nominal" first')
    rigs = checked_rig_set(at)
    for name, rig in rigs.items():
        if rig.kind != nominal.kind:
            raise top.complaint("rigs", f"{name} differs in more than numbers; a search takes one kind of rig")
    check_scenarios(top, at.start.scenarios, rigs.values())
    return rigs


def _weights(at: ExperimentFile) -> dict[str, float]:
    weights = at.top.optional_table("weights")
    return read_weights(weights.values, weights.place)


@declared
class TuneConfig(Experiment):
    """What is searched, and what for: `start` is the step experiment whose one controller has the start's numbers.

    `rig_name` is the rig as it was named, `rigs` are those of the set by name, nominal first; `weights` are those of
    USUAL_WEIGHTS. `positions`, `factors` and `limits`: see TuneProblem.
    """

    KIND = "tune"
    rig_name: str = part(_named, {})
    searched: tuple[Searched, ...] = part(_some, {})
    start: StepConfig = part(_start, _OF_THE_START)
    rig: Rig = part(lambda at: at.start.rig, {})
    rigs: Mapping[str, Rig] = part(_rigs, RIGS)
    weights: Mapping[str, float] = part(_weights, {"weights": "of the cost, one or more"})
    designs: int = count(1, MANY, "number of designs to try", asked=True)
    seed: int = count(0, MANY, "of the search and of the noise")
    positions: tuple[float, ...] = part(
        lambda at: read_positions(at.top),
        {"positions": "shares of the stroke limit at which loops are judged; five without"},
        default=POSITIONS,
    )
    factors: Factors = part(lambda at: read_factors(at.top, at.rig), WITHIN)
    limits: Limits = part(lambda at: read_limits(at.top), {"goals": "hard goals that are not as usual"})

    @property
    def name(self) -> str:
        """The name of the controller."""
        return self.start.controllers[0].name

    def step_table(self, values: Mapping[str, float], rig: str) -> dict[str, Any]:
        """The step experiment on a named rig whose controller has these numbers, each in its unit."""
        filled = _filled(self.source["controllers"][self.name], self.searched, values)
        return {**_step_table(self.source, self.name, filled), "rig": rig}

    @property
    def problem(self) -> TuneProblem:
        """The search without its file."""
        start, choice = self.start, (self.rigs, self.weights, self.designs, self.seed)
        space = start.conditions, self.positions, self.factors, self.limits
        return TuneProblem(start.rig, start.controllers[0], self.searched, start.scenarios, *choice, *space)


load_tune = TuneConfig.load


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    what = "a tune experiment, such as experiments/tune_p_dp.toml"
    takes_experiment(parser, what, TuneConfig, "tune.study:run_tune", shared=True)


def _step_table(table: Mapping[str, Any], name: str, controller: Mapping[str, Any]) -> dict[str, Any]:
    """The step experiment in a tune experiment's table."""
    rest = {key: entry for key, entry in table.items() if key not in (*_OF_THE_SEARCH, "plant", "from")}
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


def read_weights(weights: Mapping[str, Any], place: TableLocation | str) -> dict[str, float]:
    """The weights of the cost by metric, one or more, each in its `weight_unit`; names up to 0.2 are read, too.

    Raises InputError, opened by `place`.
    """
    table = ConfigTable(with_names(weights, ("weights",), []), place, *USUAL_WEIGHTS)
    if not len(table):
        raise table.error(f"missing; give some of {', '.join(f'{key} [{weight_unit(key)}]' for key in USUAL_WEIGHTS)}")
    return {key: table.positive(key, weight_unit(key)) for key in table}
