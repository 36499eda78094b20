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
    """Steps per second (lanes counted) of each way to run the position environment.

    Easy: an action is held over 100 steps. Hard: every step has another one, white noise, which makes the engine take
    ten times as many attempts a period.
    """
    rows = []
    for name, held in (("easy", 100), ("hard", 1)):
        vector, pair = gymnasium.make_vec(_ID, 256), AsyncVectorEnv([_maker()] * 2)
        rows += [
            {"name": f"single, {name}", "steps_per_second": _single(held)},
            {"name": f"vector 256, {name}", "steps_per_second": _vector(vector, 256, held)},
            {"name": f"AsyncVectorEnv of 2, {name}", "steps_per_second": _vector(pair, 2, held)},
        ]
    return rows


def _maker() -> Callable[[], gymnasium.Env]:
    return lambda: gymnasium.make(_ID)


def _single(held: int) -> float:
    env = gymnasium.make(_ID)
    env.reset(seed=0)
    actions = _actions(1, held)
    count, began = 0, perf_counter()
    while perf_counter() - began < _SECONDS:
        _, _, ended, cut, _ = env.step(actions[count % len(actions)][0])
        count += 1
        if ended or cut:
            env.reset()
    took = perf_counter() - began
    env.close()
    return count / took


def _vector(env: gymnasium.vector.VectorEnv, lanes: int, held: int) -> float:
    env.reset(seed=0)
    actions = _actions(lanes, held)
    count, began = 0, perf_counter()
    while perf_counter() - began < _SECONDS:
        env.step(actions[count % len(actions)])
        count += 1
    took = perf_counter() - began
    env.close()
    return count * lanes / took


def _actions(lanes: int, held: int) -> np.ndarray:
    drawn = 0.02 * np.random.default_rng(0).standard_normal((1000 // held, lanes, 1))
    return np.repeat(drawn, held, axis=0).astype(np.float32)
