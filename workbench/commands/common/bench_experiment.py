"""The file of a bench: controllers, its own and of other experiments, on every rig of a set in every scenario."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...base.errors import InputError
from ...base.signals import Signal
from ...base.table import ConfigTable
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
    asked_rig,
    controlled,
    read_bode,
    read_conditions,
    read_controllers,
    with_specimen,
)
from .rig_sets import RIGS, check_variations, read_rig_set
from .scenario_tables import SCENARIOS_KEYS, check_scenarios, read_scenarios


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


def _loops(at: ExperimentFile) -> tuple[BenchLoop, ...]:
    scenarios = read_scenarios(at.top, at.rig)
    asked = _asked(at, read_controllers(at), scenarios)
    loops = tuple(_loop(at, signal, asked, scenarios) for signal in asked)
    check_variations(at.top, [name for loop in loops for name in loop.rigs])
    return loops


def _loop(
    at: ExperimentFile, signal: str, asked: Mapping[str, list[ControllerSpec]], scenarios: Sequence[Scenario]
) -> BenchLoop:
    top, nominal, controllers = at.top, at.rig, asked[signal]
    if signal == "force" and "specimen" not in top:
        raise top.complaint("specimen", "a force needs something to act on; add a table [specimen]")
    rig = with_specimen(nominal, top.table("specimen")) if signal == "force" else nominal
    of_signal = isinstance(top.values.get("rigs"), Mapping)  # a table of lists, else one list for all
    members = read_rig_set(*((top.table("rigs", *asked), signal) if of_signal else (top, "rigs")), top, rig)
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
    at: ExperimentFile, controllers: Sequence[ControllerSpec], scenarios: Sequence[Scenario]
) -> dict[str, list[ControllerSpec]]:
    """Controllers by the signal that they control and scenarios ask for, position before force."""
    signals = {spec.name: controlled(at, spec) for spec in controllers}
    asked = {scenario.signal for scenario in scenarios}
    if lonely := [name for name, signal in signals.items() if signal not in asked]:
        what = f"{lonely[0]} controls the {signals[lonely[0]]}, which no scenario asks for; add one"
        raise InputError(f"{at.path}: {what}")
    if lonely := sorted(asked - set(signals.values())):
        what = f"scenarios of the {lonely[0]}, which no controller controls; add a controller"
        raise InputError(f"{at.path}: {what}")
    return {
        signal: [spec for spec in controllers if signals[spec.name] == signal] for signal in sorted(asked, reverse=True)
    }


@declared
class BenchConfig(Experiment):
    """The loops of a bench on variations of a rig."""

    KIND = "bench"
    rig: Rig = part(asked_rig, RIG)
    loops: tuple[BenchLoop, ...] = part(_loops, {**RIGS, **SCENARIOS_KEYS, **SPECIMEN, **CONTROLLERS, **BODE})
    conditions: Conditions = part(read_conditions, CONDITIONS)
