"""Experiments in which controllers play one record on a set of rigs, and on drawn ones: a sine, a file or a road."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.signals import Signal
from ...base.table import ConfigTable
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec, controller_spec
from ...control.protocol import graph_law
from ...engine import Engine
from ...loop.repeated_record import RepeatedLanes, RepeatedRecord, faded, repeated_lanes
from ...loop.rig_variations import Conditions, with_delay
from ...loop.rows import LoopSetup, loop_setup
from ...loop.scenarios import Scenario
from ...plant import build
from ...records.excitation import MultisineSpec
from ...rigs.rig import Rig
from .drawn_record import KEYS as DRAWN_KEYS, DrawnConfig, read_drawn
from .experiment import borrowed_controllers, read_conditions, read_experiment, rig_of, with_specimen
from .rig_sets import check_variations, read_rig_set
from .scenario_tables import check_scenarios, read_scenarios

KEYS = (
    *("experiment", "rig", "plant", "rigs", "variation", "specimen", "scenarios", "scenario", "from", "controllers"),
    *("rest", "fade", "ideal", "seed", *DRAWN_KEYS),
)


@dataclass(frozen=True)
class RecordExperiment:
    """A scenario that each controller plays on each rig of a set, by name, with `rest` [s] before and after.

    It fades in and out over `fade` [s]. `drawn`: plants that play it besides, or None. `source` is the experiment as it
    was read, with its controllers.
    """

    rig: Rig
    rigs: Mapping[str, Rig]
    signal: Signal
    controllers: tuple[ControllerSpec, ...]
    scenario: Scenario
    rest: float
    fade: float
    conditions: Conditions
    drawn: DrawnConfig | None
    source: Mapping[str, Any]

    @property
    def reference(self) -> np.ndarray:
        """The record [k], SI from the start."""
        return faded(self.scenario, self.rest, self.fade, self.rig.period.value)

    def setups(self, spec: ControllerSpec) -> dict[str, LoopSetup]:
        """The rigs with a loop's computing delay. Raises InputError where one has no operating point."""
        delay = self.conditions.delay(spec, self.rig)
        return {name: loop_setup(with_delay(rig, delay)) for name, rig in self.rigs.items()}

    def repeated(self, spec: ControllerSpec, setup: LoopSetup) -> RepeatedRecord:
        """What plays drives of the record on a rig."""
        return RepeatedRecord(spec, self.scenario, setup, self.conditions.noise)

    def lanes(self, spec: ControllerSpec, drawn: DrawnConfig) -> Iterator[RepeatedLanes]:
        """What plays drives of the record on the drawn plants, some hundreds at a time.

        Raises InputError for a controller that does not run in lanes.
        """
        if graph_law(spec.build(self.rig.period.value)) is None:
            raise InputError(f"{spec.name}: does not run in lanes, which drawn plants need; choose another")
        rig = with_delay(self.rig, self.conditions.delay(spec, self.rig))
        engine = Engine(build(rig))
        draw = drawn.draw(engine.plant)
        return repeated_lanes(rig, engine, spec, self.signal.name, draw.p, draw.position, self.conditions.noise)


def read_record_experiment(
    path: Path, rig: str | None, plants: int | None, kind: str, *further: str
) -> tuple[ConfigTable, RecordExperiment]:
    """An experiment of a kind, which may have `further` keys, and its document.

    `rig` and `plants` replace what it says. Raises InputError with file and key.
    """
    top = read_experiment(path)
    top.word("experiment", [kind])
    top.allow(*KEYS, *further)
    nominal = rig_of(top, path, rig)
    nominal = with_specimen(nominal, top.table("specimen")) if "specimen" in top else nominal
    rigs = read_rig_set(top, "rigs", top, nominal)
    check_variations(top, rigs)
    scenario = _scenario(top, rigs)
    tables, controllers = _controllers(top, path, nominal)
    for controller in controllers:
        signal = controller.build(nominal.period.value).measures[0]
        if signal != scenario.signal:
            raise top.complaint("scenarios", f"asks for a {scenario.signal}, {controller.name} controls the {signal}")
    source = {key: value for key, value in top.values.items() if key != "from"}
    rest = top.quantity("rest", Spec("s", 0.1, 60.0, "rest before and after the record"))
    fade, conditions = _fade(top, scenario), read_conditions(top)
    reference = faded(scenario, rest, fade, nominal.period.value)
    return top, RecordExperiment(
        rig=nominal,
        rigs=rigs,
        signal=nominal.signal(scenario.signal),
        controllers=controllers,
        scenario=scenario,
        rest=rest,
        fade=fade,
        conditions=conditions,
        drawn=read_drawn(top, nominal, conditions.seed, nominal.signal(scenario.signal), reference, plants),
        source={**source, "controllers": {name: table.values for name, table in tables.items()}},
    )


def read_multisine(table: ConfigTable, amplitude: Spec, nyquist: float, shortest: float = 0.1) -> MultisineSpec:
    """The table [measure]: the multisine by which a loop's response is measured, its amplitude within a spec, its
    period of `shortest` [s] at least. Raises InputError with file and key."""
    table.allow("amplitude", "low", "high", "seconds", "lines")
    low, high = (table.quantity(key, Spec("Hz", 1e-3, nyquist, f"{key}est frequency")) for key in ("low", "high"))
    return MultisineSpec(
        table.quantity("amplitude", amplitude),
        (low, high),
        table.quantity("seconds", Spec("s", shortest, 100.0, "one period of the multisine")),
        table.count("lines", 2),
    )


def _scenario(top: ConfigTable, rigs: Mapping[str, Rig]) -> Scenario:
    """The record: a sine, a file or a road."""
    scenario, *more = read_scenarios(top, next(iter(rigs.values())))
    if more:
        raise top.complaint("scenarios", "one record is played; name one")
    if scenario.frequency is None and scenario.waveform is None:
        raise top.complaint("scenarios", f"{scenario.name} is no record; name a sine, a file or a road")
    check_scenarios(top, [scenario], rigs.values())
    return scenario


def _fade(top: ConfigTable, scenario: Scenario) -> float:
    fade = top.quantity("fade", Spec("s", 0.0, 60.0, "over which the record fades in and out"))
    if 2 * fade > scenario.duration:
        raise top.complaint("fade", f"twice is longer than the record of {scenario.duration:g} s; shorten it")
    return fade


def _controllers(top: ConfigTable, path: Path, rig: Rig) -> tuple[dict[str, ConfigTable], tuple[ControllerSpec, ...]]:
    """The controllers of the file, its own or other files', for the rig, with their tables by name."""
    own = top.optional_table("controllers")
    tables = borrowed_controllers(top.optional_table("from"), path.parent) | {name: own.table(name) for name in own}
    if not tables:
        raise top.complaint("controllers", "none; name one here or under [from]")
    return tables, tuple(controller_spec(name, table).knowing(rig) for name, table in tables.items())
