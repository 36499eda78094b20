"""The file of a learning experiment: a controller, a record that it repeats, and the rigs on which it has to."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.signals import SIGNALS, Signal
from ...base.table import Table
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec, controller_spec
from ...loop.conditions import Conditions
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from ..common.experiment import (
    borrowed_controllers,
    read_conditions,
    read_experiment,
    rig_of,
    with_specimen,
)
from ..common.rig_sets import check_variations, read_rig_set
from ..common.scenario_tables import check_scenarios, read_scenarios

KEYS = (
    *("experiment", "rig", "rigs", "variation", "specimen", "scenarios", "scenario", "from", "controllers"),
    *("iterations", "rest", "fade", "measure", "ideal", "seed"),
)


@dataclass(frozen=True)
class MeasureConfig:
    """The multisine by which the closed loop's response is measured: amplitude (SI), band [Hz], length of a period [s],
    number of lines."""

    amplitude: float
    band: tuple[float, float]
    seconds: float
    lines: int


@dataclass(frozen=True)
class LearnConfig:
    """A scenario that a controller repeats on each rig of a set, by name; the filter is that of the first.

    rest [s] before and after the record, which fades in and out over `fade` [s]. With `measure` the filter is made of
    a measured response, else of the linear loop. `source` is the experiment as it was read, with its controller.
    """

    rig: Rig
    rigs: Mapping[str, Rig]
    signal: Signal
    controller: ControllerSpec
    scenario: Scenario
    iterations: int
    rest: float
    fade: float
    measure: MeasureConfig | None
    conditions: Conditions
    source: Mapping[str, Any]


def load_learning(path: str | Path, rig: str | None = None) -> LearnConfig:
    """Read the file; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    top.word("experiment", ["learn"])
    top.allow(*KEYS)
    nominal = rig_of(top, path, rig)
    nominal = with_specimen(nominal, top.table("specimen")) if "specimen" in top else nominal
    rigs = read_rig_set(top, "rigs", top, nominal)
    check_variations(top, rigs)
    scenario = _scenario(top, rigs)
    table, controller = _controller(top, path, nominal)
    signal = controller.build(nominal.period.value).measures[0]
    if signal != scenario.signal:
        raise top.complaint("scenarios", f"asks for a {scenario.signal}, {controller.name} controls the {signal}")
    source = {key: value for key, value in top.values.items() if key != "from"}
    return LearnConfig(
        rig=nominal,
        rigs=rigs,
        signal=SIGNALS[signal],
        controller=controller,
        scenario=scenario,
        iterations=top.count("iterations"),
        rest=top.quantity("rest", Spec("s", 0.1, 60.0, "rest before and after the record")),
        fade=_fade(top, scenario),
        measure=_measure(top.table("measure"), SIGNALS[signal], nominal) if "measure" in top else None,
        conditions=read_conditions(top),
        source={**source, "controllers": {controller.name: table.values}},
    )


def _scenario(top: Table, rigs: Mapping[str, Rig]) -> Scenario:
    """The record that is repeated: a sine, a file or a road."""
    scenario, *more = read_scenarios(top)
    if more:
        raise top.complaint("scenarios", "one record is learned at a time; name one")
    if scenario.frequency is None and scenario.waveform is None:
        raise top.complaint("scenarios", f"{scenario.name} is no record; name a sine, a file or a road")
    check_scenarios(top, [scenario], rigs.values())
    return scenario


def _fade(top: Table, scenario: Scenario) -> float:
    fade = top.quantity("fade", Spec("s", 0.0, 60.0, "over which the record fades in and out"))
    if 2 * fade > scenario.duration:
        raise top.complaint("fade", f"twice is longer than the record of {scenario.duration:g} s; shorten it")
    return fade


def _controller(top: Table, path: Path, rig: Rig) -> tuple[Table, ControllerSpec]:
    """The one controller of the file, its own or another file's, and its table."""
    own = top.optional_table("controllers")
    tables = borrowed_controllers(top.optional_table("from"), path.parent) | {name: own.table(name) for name in own}
    if len(tables) != 1:
        raise top.complaint("controllers", f"{len(tables)} of them; name one here or under [from]")
    ((name, table),) = tables.items()
    controller = controller_spec(name, table)
    controller.build(rig.period.value)
    return table, controller


def _measure(table: Table, signal: Signal, rig: Rig) -> MeasureConfig:
    table.allow("amplitude", "low", "high", "seconds", "lines")
    nyquist = 0.5 / rig.period.value
    band = tuple(table.quantity(key, Spec("Hz", 1e-3, nyquist, f"{key}est frequency")) for key in ("low", "high"))
    return MeasureConfig(
        table.quantity("amplitude", Spec(signal.si, 1e-9, 1e9, "peak of the multisine")),
        (band[0], band[1]),
        table.quantity("seconds", Spec("s", 0.1, 100.0, "one period of the multisine")),
        table.count("lines", 2),
    )
