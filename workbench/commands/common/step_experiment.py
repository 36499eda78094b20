"""Step experiments: controllers of one signal in scenarios on a rig."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...base.signals import Signal
from ...base.table import ConfigTable
from ...base.units import to_si
from ...control.controller_spec import ControllerSpec, controller_spec
from ...loop.rig_variations import Conditions
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from .experiment import BodeConfig, read_bode, read_conditions, read_experiment, rig_of, with_specimen
from .scenario_tables import check_scenarios, read_scenarios

KEYS = ("experiment", "rig", "plant", "specimen", "scenarios", "scenario", "controllers", "bode", "ideal", "seed")


@dataclass(frozen=True)
class StepConfig:
    """Steps of a loop: controllers x scenarios on a rig, with its closed-loop Bode. `signal` is the controlled one.

    `source` is the experiment file as it was read.
    """

    rig: Rig
    signal: Signal
    controllers: tuple[ControllerSpec, ...]
    scenarios: tuple[Scenario, ...]
    bode: BodeConfig
    conditions: Conditions
    source: Mapping[str, Any]


def load_steps(path: str | Path, rig: str | None = None) -> StepConfig:
    """Read a step experiment; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    if top.text("experiment") != "step":
        raise InputError(f"{path}: has no controllers")
    return step_config(top, rig_of(top, path, rig))


def step_config(top: ConfigTable, rig: Rig) -> StepConfig:
    """The tables of a step experiment on a rig. Raises InputError."""
    top.allow(*KEYS)
    rig = with_specimen(rig, top.table("specimen")) if "specimen" in top else rig
    scenarios = _scenarios(top, rig)
    signal = rig.signal(scenarios[0].signal)
    if signal.name == "force" and not rig.specimen_stiffness:
        raise top.complaint("specimen", "a force needs something to act on; add a table [specimen]")
    tables = top.optional_table("controllers")
    if not len(tables):
        raise top.complaint("controllers", "no controllers; add a table [controllers.NAME]")
    size = float(to_si(1.0, signal.unit, signal.si))
    return StepConfig(
        rig,
        signal,
        tuple(_controller(tables, name, signal, rig) for name in tables),
        scenarios,
        read_bode(top.table("bode"), f"amplitudes_{signal.unit.lower()}", size, rig),
        read_conditions(top),
        top.values,
    )


def _scenarios(top: ConfigTable, rig: Rig) -> tuple[Scenario, ...]:
    scenarios = read_scenarios(top, rig)
    for other in scenarios[1:]:
        if other.signal != scenarios[0].signal:
            what = f"{scenarios[0].name} and {other.name} are different loops; make two experiments"
            raise top.complaint("scenarios", what)
    check_scenarios(top, scenarios, [rig])
    return scenarios


def _controller(tables: ConfigTable, name: str, signal: Signal, rig: Rig) -> ControllerSpec:
    controller = controller_spec(name, tables.table(name)).knowing(rig)
    try:
        controlled = controller.build(rig.period.value).measures[0]
    except InputError as error:
        raise InputError(f"{tables.place.document}: {error}") from None
    if controlled != signal.name:
        hint = "give it a stiffness" if signal.name == "force" else "take its stiffness out"
        raise tables.complaint(name, f"controls the {controlled}, the scenarios ask for a {signal.name}; {hint}")
    return controller
