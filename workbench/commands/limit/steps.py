"""The steps of an experiment: at three places of the stroke, and a force on every specimen of its rigs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ...base.errors import InputError
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from ..common.bench_experiment import BenchConfig
from ..common.step_experiment import StepConfig

PLACES = (-0.5, 0.0, 0.5)  # of the stroke limit, where a scenario does not say where it starts


@dataclass(frozen=True)
class PlacedStep:
    """A step on a rig with its specimen, from where it starts."""

    rig: Rig
    scenario: Scenario

    @property
    def position(self) -> float:
        """Where it starts [m from mid stroke]."""
        return self.scenario.position(self.rig.limit("stroke"))

    @property
    def name(self) -> str:
        """The scenario, its place, and the stiffness of a specimen."""
        on = f" on {self.rig.specimen_stiffness:g} N/m" if self.scenario.signal == "force" else ""
        return f"{self.scenario.name} from {1e3 * self.position:g} mm{on}"


def placed_steps(config: BenchConfig | StepConfig) -> list[PlacedStep]:
    """Of every scenario, those that are no steps too. Raises InputError for a linear plant."""
    if not config.rig.is_jack:
        raise InputError(f"{config.rig.name} is a linear plant: it has no chambers, which set the limit; name a jack")
    return [
        PlacedStep(rig, placed)
        for own, others, scenarios in _loops(config)
        for scenario in scenarios
        for rig in (_specimens(own, others) if scenario.signal == "force" else [own])
        for placed in _placed(scenario)
    ]


def _loops(config: BenchConfig | StepConfig) -> Iterator[tuple[Rig, Sequence[Rig], Sequence[Scenario]]]:
    """Of every loop the nominal rig, the rigs of its set, and its scenarios."""
    if isinstance(config, StepConfig):
        yield config.rig, [], config.scenarios
        return
    for loop in config.loops:
        yield loop.rig, list(loop.rigs.values()), loop.scenarios


def _specimens(rig: Rig, others: Sequence[Rig]) -> list[Rig]:
    """The rig with its own specimen and with each that rigs of its set have."""
    found = dict.fromkeys((each["ks"], each["cs"]) for each in (rig, *others))
    return [rig.with_values(ks=stiffness, cs=damping) for stiffness, damping in found]


def _placed(scenario: Scenario) -> list[Scenario]:
    if scenario.start or scenario.start_share or not scenario.is_step:
        return [scenario]
    return [replace(scenario, start_share=share) for share in PLACES]
