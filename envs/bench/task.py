"""A task of the bench: the law, plants, scenarios, weights and goals of a train experiment."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from workbench.base.errors import InputError
from workbench.commands.common.shipped import experiment
from workbench.commands.train.options import TrainConfig, load_train
from workbench.commands.train.start import POLICY
from workbench.control.law import Law, static_law
from workbench.control.network import Network
from workbench.control.protocol import graph_law
from workbench.loop.envelope import envelope
from workbench.loop.plant_lanes import PlantLanes, joined
from workbench.loop.rig_variations import with_delay
from workbench.loop.scenarios import Limits, Scenario


@dataclass(frozen=True)
class BenchTask:
    """A policy with the shape of `policy` on top of a `law`, on one of the `plants`, in one of the `scenarios`.

    `weights` and `limits` are those of the search: see LaneScores. `source`: the experiment that it is of.
    """

    policy: Network
    law: Law
    plants: PlantLanes
    scenarios: tuple[Scenario, ...]
    weights: Mapping[str, float]
    limits: Limits
    source: TrainConfig

    def __deepcopy__(self, memo: dict[int, object]) -> "BenchTask":
        return self

    def __reduce__(self) -> tuple[object, ...]:
        return _bench_task, (self.source, self.policy, self.plants)  # a law is made of functions: it is built anew

    @property
    def periods(self) -> int:
        """Control periods from one decision to the next."""
        return round(self.policy.decision / self.plants.rig.period.value)

    @property
    def steps(self) -> int:
        """Decisions in a whole episode."""
        return round(self.limits.seconds / self.policy.decision)


def load_bench_task(path: str | Path, policy: Network) -> BenchTask:
    """A train experiment's task, its file or a shipped one by name, for policies of a shape; its plants are drawn here.

    Raises InputError for what no policy of this shape can run on.
    """
    config = load_train(experiment(str(path)))
    rig, start = config.start.rig, config.start
    scenarios = start.scenarios
    if any(each.signal != "position" or each.frequency is not None or each.arrives is None for each in scenarios):
        raise InputError(f"{path}: scenarios: the environment takes steps of position and loads; leave the others out")
    missing = set(policy.signals) - rig.sensors.keys()
    if missing:
        raise InputError(f"{path}: rig {rig.name} has no {sorted(missing)[0]} sensor, which is observed; declare one")
    periods = policy.decision / rig.period.value
    if periods < 1 or abs(periods - round(periods)) > 1e-6:
        raise InputError(f"decision = {policy.decision:g}: must be a multiple of the period, {rig.period.value:g} s")
    delay = start.conditions.delay(start.controllers[0], rig)
    whole = envelope(
        {name: with_delay(each, delay) for name, each in config.rigs.items()},
        config.positions, config.factors, config.seed,
    )  # fmt: skip
    plants = whole.varied if whole.drawn is None else joined(whole.varied, whole.drawn)
    return _bench_task(config, policy, plants)


def _bench_task(config: TrainConfig, policy: Network, plants: PlantLanes) -> BenchTask:
    return BenchTask(policy, _law(config), plants, tuple(config.start.scenarios), config.weights, config.limits, config)


def _law(config: TrainConfig) -> Law:
    """Without the network on top."""
    spec = config.start.controllers[0]
    if spec.use == POLICY:
        return static_law([0.0, 0.0], ("position",), config.start.rig.period.value)
    law = graph_law(replace(spec, compensators=spec.compensators[:-1]).build(config.start.rig.period.value))
    if law is None:
        raise InputError(f"{spec.name} does not give its graph, and runs one loop at a time; take another law")
    return law
