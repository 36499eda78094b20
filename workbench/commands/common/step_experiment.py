"""Step experiments: controllers of one signal in scenarios on a rig."""

from dataclasses import replace
from pathlib import Path

from ...base.errors import InputError
from ...base.signals import Signal
from ...base.units import to_si
from ...control.controller_spec import ControllerSpec
from ...loop.rig_variations import Conditions
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from .declared import Experiment, ExperimentFile, declared, part
from .experiment import (
    BODE,
    CONDITIONS,
    CONTROLLERS,
    RIG,
    SPECIMEN,
    BodeConfig,
    controlled,
    on_specimen,
    read_bode,
    read_conditions,
    read_controllers,
)
from .scenario_tables import SCENARIOS_KEYS, check_scenarios, read_scenarios


def _scenarios(at: ExperimentFile) -> tuple[Scenario, ...]:
    first, *others = scenarios = read_scenarios(at.top, at.rig)
    for other in others:
        if other.signal != first.signal:
            what = f"{first.name} and {other.name} are different loops; make two experiments"
            raise at.top.complaint("scenarios", what)
    check_scenarios(at.top, scenarios, [at.rig])
    return scenarios


def _signal(at: ExperimentFile) -> Signal:
    signal = at.rig.signal(at.scenarios[0].signal)
    if signal.name == "force" and not at.rig.specimen_stiffness:
        raise at.top.complaint("specimen", "a force needs something to act on; add a table [specimen]")
    return signal


def _controllers(at: ExperimentFile) -> tuple[ControllerSpec, ...]:
    specs, wanted = read_controllers(at), at.signal.name
    for spec in specs:
        try:
            own = controlled(at, spec)
        except InputError as error:
            raise InputError(f"{at.top.place.document}: {error}") from None
        if own != wanted:
            hint = "give it a stiffness" if wanted == "force" else "take its stiffness out"
            what = f"{spec.name} controls the {own}, the scenarios ask for a {wanted}; {hint}"
            raise at.top.complaint("controllers", what)
    return specs


def _bode(at: ExperimentFile) -> BodeConfig:
    unit = at.signal.unit
    size = float(to_si(1.0, unit, at.signal.si))
    return read_bode(at.top.table("bode"), f"amplitudes_{unit.lower()}", size, at.rig)


@declared
class StepConfig(Experiment):
    """Steps of a loop: controllers x scenarios on a rig, with its closed-loop Bode. `signal` is the controlled one."""

    KIND = "step"
    rig: Rig = part(on_specimen, RIG | SPECIMEN)
    scenarios: tuple[Scenario, ...] = part(_scenarios, SCENARIOS_KEYS)
    signal: Signal = part(_signal, {})
    controllers: tuple[ControllerSpec, ...] = part(_controllers, CONTROLLERS)
    bode: BodeConfig = part(_bode, BODE)
    conditions: Conditions = part(read_conditions, CONDITIONS)


def load_steps(path: str | Path, rig: str | None = None, only: str | None = None) -> StepConfig:
    """Read a step experiment, of its controllers the one that --controller names, where it does. Raises InputError."""
    config = StepConfig.load(path, rig)
    names = [spec.name for spec in config.controllers]
    if only not in (None, *names):
        raise InputError(f"--controller {only}: no controller {only}; it has {', '.join(names)}")
    return replace(config, controllers=tuple(spec for spec in config.controllers if only in (None, spec.name)))
