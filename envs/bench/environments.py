"""What a policy adds to a tuned law, on the envelope on which a bench judges it: single, and side by side."""

from pathlib import Path

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode

from ..one_lane import OneJack, action_space, refuse_render_mode
from ..vector import LaneVectorEnv, autoreset, checked_lanes
from .core import BOUND, BenchCore, silent_policy
from .task import load_bench_task


class JackBench(OneJack[BenchCore]):
    """Add to the command of a tuned law, such that steps and loads cost less than under the law alone.

    All but the decisions is that of a train experiment (`jackbench train`), a file or a shipped one by name: the rig,
    the law, the scenarios, the weights, and the set of plants: the variations of the rig or rig files that it lists,
    and 4000 plants drawn over its factors and every other declared bound, over the whole stroke. Plant, law, guard,
    drive with computing delay, and sensors with noise and resolution run as in a bench, every control period (1 ms).

    ## Observation
    Box(-10, 10, (1 + 2 past,), float32), every `decision` seconds; each over its full scale, cut at ten times that:

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0 | error | `error`, 10 mm | reference less measured position |
    | 1 .. past | moved | `error`, 10 mm | measured position less that of 1 .. past decisions ago |
    | past + 1 .. 2 past | pushed | `pressure`, 50 bar | pa - pb, measured, less that of 1 .. past decisions ago |

    ## Action
    Box(-1, 1, (1,), float32): what is added to the law's command, over `limit` (0.1 of the full command), held until
    the next decision. The law goes on every control period, and does not learn of it; the guard limits the sum.

    ## Reward
    The rewards of an episode add up to -(60/s time outside the band + 0.02/% overshoot + 0.1/s IAE + 0.1 travel), less
    100 if it trips. The weights are the experiment's; that of `ms` is of the travel, the sum of the magnitudes
    of the changes of the command: noise and ringing show in it, on plants as wide as the envelope and under load, but
    no single run shows Ms. Time outside the band and overshoot count in steps only. The band is 2 % of the step, and no
    less than three standard deviations of the sensor's noise; IAE is over the step's size, or over the band of a load.
    A search makes the worst plant's numbers small, the reward their mean.

    ## Start
    At rest at the equilibrium of one of the plants, with no specimen; one of the experiment's scenarios begins: steps
    towards the middle of the stroke, a load after 0.5 s. All that is random in an episode is drawn at its reset.

    ## End
    Terminated when the guard trips or the simulation fails; `info["trip"]` then says why. Truncated after the
    experiment's `seconds` (1 s).

    ## Success
    `info["is_success"]`, at the end: no trip, and a step that settled and went over by no more than the experiment's
    `overshoot_percent` (2.5 %).

    ## Picture
    With `render_mode="rgb_array"`, `render()` draws the jack, and what was asked for, came and was commanded so far.

    ## Info
    `error`: the true one [m]; `command`: the realised one [1]; `settling` [s] and `overshoot` [%] so far.

    ## Versions
    v0: the first.
    """

    def __init__(
        self,
        experiment: str | Path = "train_p_dp",
        decision: float = 0.005,
        past: int = 4,
        limit: float = 0.1,
        error: float = 0.01,
        pressure: float = 5e6,
        render_mode: str | None = None,
    ) -> None:
        """`decision` in s, a multiple of the control period, `error` in m, `pressure` in Pa.

        Raises InputError for an experiment that is no train experiment of steps of position and loads.
        """
        policy = silent_policy(error, pressure, past, limit, decision)
        core = BenchCore(load_bench_task(experiment, policy), 1)
        self._wrap_jack(core, _observation(past), render_mode, (core.task.plants.rig, "position", decision))


class JackBenchVector(LaneVectorEnv[BenchCore]):
    """JackBench over `num_envs` lanes: lane i does what JackBench with the same seed does.

    For `autoreset_mode` see JackPositionVector.
    """

    def __init__(
        self,
        num_envs: int = 1,
        experiment: str | Path = "train_p_dp",
        decision: float = 0.005,
        past: int = 4,
        limit: float = 0.1,
        error: float = 0.01,
        pressure: float = 5e6,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        """Takes what JackBench does. Raises InputError as that does, for another mode, and for a `render_mode`."""
        refuse_render_mode(render_mode)
        mode, lanes = autoreset(autoreset_mode), checked_lanes(num_envs)
        policy = silent_policy(error, pressure, past, limit, decision)
        self._wrap(
            BenchCore(load_bench_task(experiment, policy), lanes), lanes, _observation(past), action_space(), mode
        )


def _observation(past: int) -> Box:
    return Box(-BOUND, BOUND, (1 + 2 * past,), np.float32)
