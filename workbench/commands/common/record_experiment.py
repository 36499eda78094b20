"""Experiments in which controllers play one record on a set of rigs, and on drawn ones: a sine, a file or a road."""

from collections.abc import Iterator, Mapping

import numpy as np

from ...base.errors import InputError
from ...base.signals import Signal
from ...base.table import ConfigTable
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec
from ...control.protocol import graph_law
from ...engine import Engine
from ...loop.repeated_record import RepeatedLanes, RepeatedRecord, faded, repeated_lanes
from ...loop.rig_variations import Conditions, with_delay
from ...loop.rows import LoopSetup, loop_setup
from ...loop.scenarios import Scenario
from ...plant import build
from ...records.excitation import MultisineSpec
from ...rigs.rig import Rig
from .declared import Experiment, ExperimentFile, count, declared, part, quantity
from .drawn_record import DrawnConfig, read_drawn
from .envelope_keys import MOST_PLANTS, WITHIN
from .experiment import (
    CONDITIONS,
    CONTROLLERS,
    RIG,
    SPECIMEN,
    controlled,
    on_specimen,
    read_conditions,
    read_controllers,
)
from .rig_sets import RIGS, checked_rig_set
from .scenario_tables import SCENARIOS_KEYS, check_scenarios, read_scenarios

MEASURE = {"measure": "the multisine by which the loop is measured"}


def _scenario(at: ExperimentFile) -> Scenario:
    """The record: a sine, a file or a road."""
    top = at.top
    scenario, *more = read_scenarios(top, next(iter(at.rigs.values())))
    if more:
        raise top.complaint("scenarios", "one record is played; name one")
    if scenario.frequency is None and scenario.waveform is None:
        raise top.complaint("scenarios", f"{scenario.name} is no record; name a sine, a file or a road")
    check_scenarios(top, [scenario], at.rigs.values())
    return scenario


def _controllers(at: ExperimentFile) -> tuple[ControllerSpec, ...]:
    specs = read_controllers(at)
    for spec in specs:
        if (signal := controlled(at, spec)) != at.scenario.signal:
            raise at.top.complaint("scenarios", f"asks for a {at.scenario.signal}, {spec.name} controls the {signal}")
    return specs


def _fade(at: ExperimentFile) -> float:
    fade = at.top.quantity("fade", Spec("s", 0.0, 60.0, "over which the record fades in and out"))
    if 2 * fade > at.scenario.duration:
        raise at.top.complaint("fade", f"twice is longer than the record of {at.scenario.duration:g} s; shorten it")
    return fade


@declared
class RecordExperiment(Experiment):
    """A scenario that each controller plays on each rig of a set, by name, with `rest` [s] before and after.

    It fades in and out over `fade` [s]. `drawn`: plants that play it besides, or None.
    """

    rig: Rig = part(on_specimen, RIG | SPECIMEN)
    rigs: Mapping[str, Rig] = part(checked_rig_set, RIGS)
    scenario: Scenario = part(_scenario, SCENARIOS_KEYS)
    signal: Signal = part(lambda at: at.rig.signal(at.scenario.signal), {})
    controllers: tuple[ControllerSpec, ...] = part(_controllers, CONTROLLERS)
    rest: float = quantity("s", 0.1, 60.0, "rest before and after the record")
    fade: float = part(_fade, {"fade": "over which the record fades in and out"})
    conditions: Conditions = part(read_conditions, CONDITIONS)
    plants: int | None = count(1, MOST_PLANTS, "plants to draw besides the set; none without", default=None, asked=True)
    drawn: DrawnConfig | None = part(
        read_drawn, {"stroke": "share of the stroke limit in which the record lies", **WITHIN}, default=None
    )

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
