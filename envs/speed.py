"""How fast the environments step: single, vector, and Gymnasium's own AsyncVectorEnv of two single ones."""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv

import envs

_ID = f"{envs.__name__}:JackPosition-v0"  # the name before the colon registers it
_SECONDS = 2.0


def measure() -> list[dict[str, Any]]:
    """Steps per second (lanes counted) of each way to run the position environment with small random actions."""
    return [
        {"name": "single", "steps_per_second": _single()},
        {"name": "vector 256", "steps_per_second": _vector(gymnasium.make_vec(_ID, 256), 256)},
        {"name": "AsyncVectorEnv of 2", "steps_per_second": _vector(AsyncVectorEnv([_maker()] * 2), 2)},
    ]


def _maker() -> Callable[[], gymnasium.Env]:
    return lambda: gymnasium.make(_ID)


def _single() -> float:
    env = gymnasium.make(_ID)
    env.reset(seed=0)
    actions = _actions(1)
    count, began = 0, perf_counter()
    while perf_counter() - began < _SECONDS:
        _, _, ended, cut, _ = env.step(actions[count % len(actions)][0])
        count += 1
        if ended or cut:
            env.reset()
    took = perf_counter() - began
    env.close()
    return count / took


def _vector(env: gymnasium.vector.VectorEnv, lanes: int) -> float:
    env.reset(seed=0)
    actions = _actions(lanes)
    count, began = 0, perf_counter()
    while perf_counter() - began < _SECONDS:
        env.step(actions[count % len(actions)])
        count += 1
    took = perf_counter() - began
    env.close()
    return count * lanes / took


def _actions(lanes: int) -> np.ndarray:
    return (0.02 * np.random.default_rng(0).standard_normal((100, lanes, 1))).astype(np.float32)
