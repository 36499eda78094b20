"""Many jacks side by side as a Gymnasium vector environment: a shell over a core of as many lanes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from workbench.base.errors import InputError

from .core import Core, Stepped
from .lane_guard import Trip
from .spaces import action_space, observation_space, refuse_options
from .task import load_task


class _Jacks(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """What both loops share."""

    loop: ClassVar[str]

    def __init__(self, num_envs: int, task: str | Path) -> None:
        if num_envs < 1:
            raise InputError(f"num_envs = {num_envs}: must be 1 or more")
        self.core = Core(load_task(task, self.loop), num_envs)
        self.num_envs = num_envs
        self.metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}
        self.single_action_space = action_space()
        self.single_observation_space = observation_space(self.core.channels)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._random: list[np.random.Generator] = []

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in every lane. An int seeds lane i with seed + i, a sequence each lane; None goes on.

        Raises InputError for options, and for a sequence of another length than num_envs.
        """
        refuse_options(options)
        seeds: Sequence[int | None] = [None] * self.num_envs
        if seed is not None:
            seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        if len(seeds) != self.num_envs:
            raise InputError(
                f"reset: {len(seeds)} seeds for {self.num_envs} lanes; give one a lane, or a single number"
            )
        before = self._random or [None] * self.num_envs
        self._random = [
            seeding.np_random(new)[0] if old is None or new is not None else old
            for old, new in zip(before, seeds, strict=True)
        ]
        begun = self.core.reset(self._random)
        return begun.observation, self._infos(begun)

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One step of every lane with actions [num_envs, 1]; see Gymnasium. Raises ResetNeeded before a reset."""
        if not self._random:
            raise ResetNeeded("no episode is going on; call reset() first")
        stepped = self.core.step(np.asarray(actions, float).reshape(self.num_envs))
        return stepped.observation, stepped.reward, stepped.terminated, stepped.truncated, self._infos(stepped)

    def _infos(self, stepped: Stepped) -> dict[str, Any]:
        """Arrays over the lanes, each with its mask, as Gymnasium has them."""
        everyone = np.ones((2, self.num_envs), bool)
        command = stepped.command.copy()  # the guard goes on from its own
        infos = {"error": stepped.error, "_error": everyone[0], "command": command, "_command": everyone[1]}
        ended = stepped.terminated
        if np.count_nonzero(ended):
            infos["_trip"], infos["trip"] = ended.copy(), np.full(self.num_envs, None, dtype=object)
            infos["trip"][ended] = [Trip(code).reason for code in self.core.trip[ended]]
        return infos


class JackPositionVector(_Jacks):
    """JackPosition over `num_envs` lanes: lane i does what JackPosition with the same seed does, bit for bit.

    A lane whose episode has ended begins its next one in the step after (AutoresetMode.NEXT_STEP): that step ignores
    its action and gives the first observation, reward 0 and no end.
    """

    loop = "position"

    def __init__(self, num_envs: int = 1, task: str | Path = "position") -> None:
        super().__init__(num_envs, task)


class JackForceVector(_Jacks):
    """JackForce over `num_envs` lanes; see JackPositionVector."""

    loop = "force"

    def __init__(self, num_envs: int = 1, task: str | Path = "force") -> None:
        super().__init__(num_envs, task)
