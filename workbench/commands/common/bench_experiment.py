"""The file of a bench: controllers, its own and of other experiments, on every rig of a set in every scenario."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.errors import InputError, echo
from ...base.signals import Signal
from ...base.table import ConfigTable
from ...control.controller_spec import ControllerSpec, controller_spec
from ...loop.rig_variations import Conditions
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from .experiment import (
    BodeConfig,
    borrowed_controllers,
    read_bode,
    read_conditions,
    read_experiment,
    rig_of,
    with_specimen,
)
from .rig_sets import check_variations, read_rig_set
from .scenario_tables import check_scenarios, read_scenarios

KEYS = (
    *(
        "experiment",
        "rig",
        "plant",
        "rigs",
        "variation",
        "scenarios",
        "scenario",
        "specimen",
        "from",
        "controllers",
        "bode",
    ),
    *("ideal", "seed"),
)


@dataclass(frozen=True)
class BenchLoop:
    """The loops of one controlled signal: every controller on every rig of a set, by name, in every scenario.

    `rig` is the nominal one, with the specimen of a force. On the first of the set, the closed loop is also swept by
    the sines of `bode`.
    """

    signal: Signal
    rig: Rig
    rigs: Mapping[str, Rig]
    controllers: tuple[ControllerSpec, ...]
    scenarios: tuple[Scenario, ...]
    bode: BodeConfig

    @property
    def first(self) -> str:
        """The name of the first rig of the set."""
        return next(iter(self.rigs))


@dataclass(frozen=True)
class BenchConfig:
    """The loops of a bench on variations of a rig.

    `source` is the experiment file as it was read, with the tables of all its controllers.
    """

    rig: Rig
    loops: tuple[BenchLoop, ...]
    conditions: Conditions
    source: Mapping[str, Any]


def load_bench(path: str | Path, rig: str | None = None) -> BenchConfig:
    """Read the file of a bench; `rig` replaces the nominal one it names. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    if top.text("experiment") != "bench":
        raise top.complaint("experiment", f'{echo(top.values["experiment"])}; a bench needs experiment = "bench"')
    top.allow(*KEYS)
    nominal = rig_of(top, path, rig)
    tables = {**borrowed_controllers(top.optional_table("from"), path.parent), **_own(top)}
    scenarios = read_scenarios(top, nominal)
    controllers = [controller_spec(name, table).knowing(nominal) for name, table in tables.items()]
    asked = _asked(controllers, scenarios, nominal, str(path))
    lists = _sets(top, asked)
    loops = tuple(_loop(top, nominal, signal, lists[signal], asked[signal], scenarios) for signal in asked)
    check_variations(top, [name for loop in loops for name in loop.rigs])
    source = {key: value for key, value in top.values.items() if key != "from"}
    source["controllers"] = {name: part.values for name, part in tables.items()}
    return BenchConfig(nominal, loops, read_conditions(top), source)


def _loop(
    top: ConfigTable,
    nominal: Rig,
    signal: str,
    rigs: tuple[ConfigTable, str],
    controllers: Sequence[ControllerSpec],
    scenarios: Sequence[Scenario],
) -> BenchLoop:
    if signal == "force" and "specimen" not in top:
        raise top.complaint("specimen", "a force needs something to act on; add a table [specimen]")
    rig = with_specimen(nominal, top.table("specimen")) if signal == "force" else nominal
    members = read_rig_set(*rigs, top, rig)
    _check_sensors(top, controllers, members)
    full = rig.limit("force" if signal == "force" else "stroke")
    bode = read_bode(top.table("bode"), "amplitudes_percent", full / 100, rig)
    own = tuple(scenario for scenario in scenarios if scenario.signal == signal)
    check_scenarios(top, own, members.values())
    return BenchLoop(rig.signal(signal), rig, members, tuple(controllers), own, bode)


def _check_sensors(top: ConfigTable, controllers: Sequence[ControllerSpec], rigs: Mapping[str, Rig]) -> None:
    for controller in controllers:
        period = next(iter(rigs.values())).period.value
        for sensor in controller.build(period).measures:
            if lacking := [name for name, rig in rigs.items() if sensor not in rig.sensors]:
                raise top.complaint("rigs", f"{lacking[0]} has no {sensor} sensor, which {controller.name} needs")


def _asked(
    controllers: Sequence[ControllerSpec], scenarios: Sequence[Scenario], rig: Rig, where: str
) -> dict[str, list[ControllerSpec]]:
    """Controllers by the signal that they control and scenarios ask for, position before force."""
    controlled = {controller.name: controller.build(rig.period.value).measures[0] for controller in controllers}
    asked = {scenario.signal for scenario in scenarios}
    if lonely := [name for name, signal in controlled.items() if signal not in asked]:
        raise InputError(
            f"{where}: {lonely[0]} controls the {controlled[lonely[0]]}, which no scenario asks for; add one"
        )
    if lonely := sorted(asked - set(controlled.values())):
        raise InputError(f"{where}: scenarios of the {lonely[0]}, which no controller controls; add a controller")
    return {
        signal: [controller for controller in controllers if controlled[controller.name] == signal]
        for signal in sorted(asked, reverse=True)
    }


def _sets(top: ConfigTable, signals: Iterable[str]) -> dict[str, tuple[ConfigTable, str]]:
    """Where the list of rigs for each signal's loops is: one for all, or a table of lists."""
    if not isinstance(top.values.get("rigs"), Mapping):
        return dict.fromkeys(signals, (top, "rigs"))
    table = top.table("rigs", *signals)
    return {signal: (table, signal) for signal in signals}


def _own(top: ConfigTable) -> dict[str, ConfigTable]:
    tables = top.optional_table("controllers")
    return {name: tables.table(name) for name in tables}
