"""A vector environment of this package as Stable-Baselines3 takes one; needs `pip install 'jackbench[rl]'`."""

from collections.abc import Sequence
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from workbench.base.errors import InputError

try:
    _vec_env = import_module("stable_baselines3.common.vec_env")
except ImportError:
    raise InputError("Stable-Baselines3 is not installed; pip install 'jackbench[rl]'") from None


class StableBaselinesLanes(_vec_env.VecEnv):
    """The lanes of a native vector environment, all in one call, instead of a DummyVecEnv of single ones.

    An episode that ends begins anew in the same step; its last observation is `terminal_observation` in the lane's
    info, which says as `TimeLimit.truncated` whether its time was over. A lane's info is empty else. Raises InputError
    for an environment that resets in the next step.
    """

    def __init__(self, env: VectorEnv[np.ndarray, np.ndarray, np.ndarray]) -> None:
        if env.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
            raise InputError('Stable-Baselines3 resets in the same step; make it with autoreset_mode="SameStep"')
        self.env, self._actions = env, np.zeros(0)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> np.ndarray:
        """First observations [lanes, channels]; of the seeds that `seed` gave, once."""
        observation, _ = self.env.reset(seed=self._seeds)
        self._reset_seeds()
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """The actions [lanes, 1] of the next `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Observations [lanes, channels], rewards and ends [lanes], and the infos of the lanes."""
        observation, reward, terminated, truncated, infos = self.env.step(self._actions)
        lanes: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        done = terminated | truncated
        for lane in np.flatnonzero(done):
            lanes[lane]["terminal_observation"] = infos["final_obs"][lane]
            lanes[lane]["TimeLimit.truncated"] = bool(truncated[lane] and not terminated[lane])
        return observation, reward.astype(np.float32), done, lanes

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: int | Sequence[int] | None = None) -> list[Any]:
        """An attribute of the environment, which all lanes share, for each of some lanes."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: int | Sequence[int] | None = None) -> None:
        """Set an attribute of the environment, for all lanes at once."""
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *arguments: Any, indices: int | Sequence[int] | None = None, **named: Any
    ) -> list[Any]:
        """Call a method of the environment, once; its answer for each of some lanes."""
        answer = getattr(self.env, method_name)(*arguments, **named)
        return [answer for _ in self._get_indices(indices)]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper], indices: int | Sequence[int] | None = None
    ) -> list[bool]:
        """No lane is."""
        return [False for _ in self._get_indices(indices)]
