"""The steps of an experiment: at three places of the stroke, and a force on every rig with another specimen."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ...base.errors import InputError
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from ..common.bench_experiment import BenchConfig
from ..common.step_experiment import StepConfig

_NOMINAL = "nominal"
PLACES = (-0.5, 0.0, 0.5)  # of the stroke limit, where a scenario does not say where it starts


@dataclass(frozen=True)
class PlacedStep:
    """A step on a rig with its specimen, `of` a name in its set, from where it starts."""

    rig: Rig
    of: str
    scenario: Scenario

    @property
    def position(self) -> float:
        """Where it starts [m from mid stroke]."""
        return self.scenario.position(self.rig.limit("stroke"))

    @property
    def name(self) -> str:
        """The scenario, its place, and where a force acts on a specimen the rig."""
        on = f" on {self.of}" if self.scenario.signal == "force" else ""
        return f"{self.scenario.name} from {1e3 * self.position:g} mm{on}"


def placed_steps(config: BenchConfig | StepConfig) -> list[PlacedStep]:
    """Of every scenario, those that are no steps too. Raises InputError for a linear plant."""
    if not config.rig.is_jack:
        raise InputError(f"{config.rig.name} is a linear plant: it has no chambers, which set the limit; name a jack")
    return [
        PlacedStep(rig, name, placed)
        for own, others, scenarios in _loops(config)
        for scenario in scenarios
        for name, rig in (_specimens(own, others) if scenario.signal == "force" else {_NOMINAL: own}).items()
        for placed in _placed(scenario)
    ]


def _loops(config: BenchConfig | StepConfig) -> Iterator[tuple[Rig, Mapping[str, Rig], Sequence[Scenario]]]:
    """Of every loop the nominal rig, the rigs of its set by name, and its scenarios."""
    if isinstance(config, StepConfig):
        yield config.rig, {}, config.scenarios
        return
    for loop in config.loops:
        yield loop.rig, loop.rigs, loop.scenarios


def _specimens(rig: Rig, others: Mapping[str, Rig]) -> dict[str, Rig]:
    """The nominal rig, and each of its set that presses on another specimen, by name."""
    own = rig["ks"], rig["cs"]
    return {_NOMINAL: rig} | {name: other for name, other in others.items() if (other["ks"], other["cs"]) != own}


def _placed(scenario: Scenario) -> list[Scenario]:
    if scenario.start or scenario.start_share or not scenario.is_step:
        return [scenario]
    return [replace(scenario, start_share=share) for share in PLACES]
