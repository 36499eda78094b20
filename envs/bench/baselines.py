"""What episodes of a task cost under any controller, and under any policy in the environment: rewards to beat."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.control.controller_spec import ControllerSpec
from workbench.loop.batch import BatchRun, play_lanes
from workbench.loop.scenarios import Scenario

from .core import TRIP, LaneScores
from .environments import JackBenchVector
from .task import BenchTask


@dataclass(frozen=True)
class Episodes:
    """Scores of whole episodes [k]: returns, settling [s] and overshoot [%], NaN of a load, and which tripped."""

    returns: np.ndarray
    settling: np.ndarray
    overshoot: np.ndarray
    tripped: np.ndarray

    @property
    def row(self) -> tuple[float, float, float, float, float, float]:
        """Mean and least return, mean and longest settling [s], largest overshoot [%], and share of the tripped."""
        settling = np.nanmean(self.settling), np.nanmax(self.settling)
        numbers = self.returns.mean(), self.returns.min(), *settling, np.nanmax(self.overshoot), self.tripped.mean()
        mean, least, settled, longest, over, tripped = map(float, numbers)
        return mean, least, settled, longest, over, tripped


def controller_episodes(task: BenchTask, spec: ControllerSpec, count: int, seed: int = 0) -> Episodes:
    """A controller in the place of law and policy: every scenario on `count` of the plants. Raises ValueError for one
    that has no form in lanes."""
    random, k = np.random.default_rng(seed), task.steps * task.periods
    plants = task.plants.some(random.choice(len(task.plants.p), count, replace=False).tolist())
    period, rig = plants.rig.period.value, plants.rig
    t, way = np.arange(k + 1) * period, np.where(plants.position > 0, -1.0, 1.0)
    episodes = []
    for scenario in task.scenarios:
        runs = play_lanes(
            plants.engine, rig, spec.build(period), plants.null, plants.p, way[:, None] * scenario.reference(t),
            ("position",), task.source.start.conditions.noise, scenario.inputs(t),
        )  # fmt: skip
        episodes += [_scored(task, scenario, run, way[part], plants.null.u[part, 0]) for part, run in runs]
    return Episodes(*map(np.concatenate, zip(*episodes, strict=True)))


def _scored(
    task: BenchTask, scenario: Scenario, run: BatchRun, way: np.ndarray, command: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Returns, settling, overshoot and trips [lanes] of runs from commands [lanes], towards `way` [lanes]."""
    position, lanes = run.signals["position"], np.arange(len(way))
    t = np.arange(1, position.shape[1]) * task.plants.rig.period.value
    scores = LaneScores(task.plants.rig, task.weights, len(way))
    for lane in range(len(way)):
        scores.reset(lane, scenario, position[lane, 0], way[lane])
    changes = np.diff(run.sent[:, :-1], axis=1, prepend=command[:, None])
    rewards = np.nan_to_num(scores.rewards(lanes, np.tile(t, (len(way), 1)), position[:, 1:], changes))
    tripped = (run.trip > 0) | run.failed
    step = 1.0 if scenario.size else np.nan
    return rewards - TRIP * tripped, step * scores.settling, step * scores.overshoot, tripped


def policy_episodes(env: JackBenchVector, act: Callable[[np.ndarray], np.ndarray], seed: int = 0) -> Episodes:
    """An episode in every lane of actions act(observations [lanes, channels]) -> [lanes, 1]."""
    observation, _ = env.reset(seed=seed)
    task, core, lanes = env.core.task, env.core, env.num_envs
    steps = np.where([task.scenarios[i].size != 0 for i in core.scenario], 1.0, np.nan)
    returns, going, tripped = np.zeros(lanes), np.ones(lanes, bool), np.zeros(lanes, bool)
    settling, overshoot = np.zeros(lanes), np.zeros(lanes)
    for _ in range(task.steps):
        observation, rewards, terminated, truncated, infos = env.step(act(observation))
        last = infos.get("final_info", infos)
        ends = going & (terminated | truncated)
        returns += going * rewards
        tripped |= ends & terminated
        settling[ends], overshoot[ends] = last["settling"][ends], last["overshoot"][ends]
        going &= ~ends
    return Episodes(returns, steps * settling, steps * overshoot, tripped)
