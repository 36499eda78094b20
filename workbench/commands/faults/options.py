"""`jackbench faults EXPERIMENT`: controllers, the steps in which faults begin, and plants without a fault."""

import argparse

from ...base.units import Spec
from ...control.controller_spec import ControllerSpec
from ...loop.fault_trial import FaultLoops, FaultTrials
from ...loop.rig_variations import Conditions
from ...rigs.rig import Rig
from ..common.declared import Experiment, ExperimentFile, count, declared, fraction, part, quantity, takes_experiment
from ..common.envelope_keys import MOST_PLANTS, WITHIN, read_factors
from ..common.experiment import (
    CONDITIONS,
    CONTROLLERS,
    SPECIMEN,
    asked_jack,
    controlled,
    read_conditions,
    read_controllers,
    with_specimen,
)

_STEPS = {"position": Spec("m", 1e-6, 1.0, "step of position"), "force": Spec("N", 1.0, 1e9, "step of force")}


def _loops(at: ExperimentFile) -> tuple[FaultLoops, ...]:
    """The loops of each controlled signal, position first."""
    signals: dict[str, list[ControllerSpec]] = {}
    for spec in read_controllers(at):
        signals.setdefault(controlled(at, spec), []).append(spec)
    return tuple(_of_signal(at, signal, tuple(signals[signal])) for signal in sorted(signals, reverse=True))


def _of_signal(at: ExperimentFile, signal: str, controllers: tuple[ControllerSpec, ...]) -> FaultLoops:
    steps = at.top.table("steps", *_STEPS)
    rig = with_specimen(at.rig, at.top.table("specimen")) if signal == "force" else at.rig
    return FaultLoops(signal, rig, steps.quantity(signal, _STEPS[signal]), read_factors(at.top, rig), controllers)


@declared
class FaultsConfig(FaultTrials, Experiment):
    """A faults experiment."""

    KIND = "faults"
    rig: Rig = part(asked_jack, {"rig": "a jack"})
    loops: tuple[FaultLoops, ...] = part(
        _loops, {"steps": "in which faults begin, by controlled signal", **SPECIMEN, **WITHIN, **CONTROLLERS}
    )
    plants: int = count(1, MOST_PLANTS, "drawn plants without a fault, on which the guard must not trip", asked=True)
    stroke: float = fraction("of the stroke limit in which steps lie")
    seconds: float = quantity("s", 0.2, 10.0, "how long a loop is watched")
    conditions: Conditions = part(read_conditions, CONDITIONS)


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    takes_experiment(
        parser, "a faults experiment, such as experiments/faults.toml", FaultsConfig, "faults.study:run_faults"
    )
