"""Experiments in which one controller plays one record on a set of rigs: a sine, a file or a road, faded in and out."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.signals import SIGNALS, Signal
from ...base.table import Table
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec, controller_spec
from ...loop.conditions import Conditions
from ...loop.repeated_record import RepeatedRecord, faded
from ...loop.rig_variations import with_delay
from ...loop.rows import LoopSetup, loop_setup
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from .experiment import borrowed_controllers, read_conditions, read_experiment, rig_of, with_specimen
from .rig_sets import check_variations, read_rig_set
from .scenario_tables import check_scenarios, read_scenarios

KEYS = (
    *("experiment", "rig", "rigs", "variation", "specimen", "scenarios", "scenario", "from", "controllers"),
    *("rest", "fade", "ideal", "seed"),
)


@dataclass(frozen=True)
class RecordExperiment:
    """A scenario that a controller plays on each rig of a set, by name, with `rest` [s] before and after.

    It fades in and out over `fade` [s]. `source` is the experiment as it was read, with its controller.
    """

    rig: Rig
    rigs: Mapping[str, Rig]
    signal: Signal
    controller: ControllerSpec
    scenario: Scenario
    rest: float
    fade: float
    conditions: Conditions
    source: Mapping[str, Any]

    @property
    def reference(self) -> np.ndarray:
        """The record [k], SI from the start."""
        return faded(self.scenario, self.rest, self.fade, self.rig.period.value)

    def setups(self) -> dict[str, LoopSetup]:
        """The rigs with the loop's computing delay. Raises InputError where one has no operating point."""
        delay = self.conditions.delay(self.controller, self.rig)
        return {name: loop_setup(with_delay(rig, delay)) for name, rig in self.rigs.items()}

    def repeated(self, setup: LoopSetup) -> RepeatedRecord:
        """What plays drives of the record on a rig."""
        return RepeatedRecord(self.controller, self.scenario, setup, self.conditions.noise)


def read_record_experiment(path: Path, rig: str | None, kind: str, *further: str) -> tuple[Table, RecordExperiment]:
    """An experiment of a kind, which may have `further` keys, and its document; `rig` replaces the one it names.

    Raises InputError with file and key.
    """
    top = read_experiment(path)
    top.word("experiment", [kind])
    top.allow(*KEYS, *further)
    nominal = rig_of(top, path, rig)
    nominal = with_specimen(nominal, top.table("specimen")) if "specimen" in top else nominal
    rigs = read_rig_set(top, "rigs", top, nominal)
    check_variations(top, rigs)
    scenario = _scenario(top, rigs)
    table, controller = _controller(top, path)
    signal = controller.build(nominal.period.value).measures[0]
    if signal != scenario.signal:
        raise top.complaint("scenarios", f"asks for a {scenario.signal}, {controller.name} controls the {signal}")
    source = {key: value for key, value in top.values.items() if key != "from"}
    return top, RecordExperiment(
        rig=nominal,
        rigs=rigs,
        signal=SIGNALS[signal],
        controller=controller,
        scenario=scenario,
        rest=top.quantity("rest", Spec("s", 0.1, 60.0, "rest before and after the record")),
        fade=_fade(top, scenario),
        conditions=read_conditions(top),
        source={**source, "controllers": {controller.name: table.values}},
    )


def _scenario(top: Table, rigs: Mapping[str, Rig]) -> Scenario:
    """The record: a sine, a file or a road."""
    scenario, *more = read_scenarios(top, next(iter(rigs.values())))
    if more:
        raise top.complaint("scenarios", "one record is played; name one")
    if scenario.frequency is None and scenario.waveform is None:
        raise top.complaint("scenarios", f"{scenario.name} is no record; name a sine, a file or a road")
    check_scenarios(top, [scenario], rigs.values())
    return scenario


def _fade(top: Table, scenario: Scenario) -> float:
    fade = top.quantity("fade", Spec("s", 0.0, 60.0, "over which the record fades in and out"))
    if 2 * fade > scenario.duration:
        raise top.complaint("fade", f"twice is longer than the record of {scenario.duration:g} s; shorten it")
    return fade


def _controller(top: Table, path: Path) -> tuple[Table, ControllerSpec]:
    """The one controller of the file, its own or another file's, and its table."""
    own = top.optional_table("controllers")
    tables = borrowed_controllers(top.optional_table("from"), path.parent) | {name: own.table(name) for name in own}
    if len(tables) != 1:
        raise top.complaint("controllers", f"{len(tables)} of them; name one here or under [from]")
    ((name, table),) = tables.items()
    return table, controller_spec(name, table)
