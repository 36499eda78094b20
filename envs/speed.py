"""How fast the environments step: single, vector, and Gymnasium's own AsyncVectorEnv of two single ones."""

from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces.utils import flatdim
from gymnasium.vector import AsyncVectorEnv

import envs

_ID = f"{envs.__name__}:JackPosition-v0"  # the name before the colon registers it
_SECONDS = 2.0
_HELD = {"easy": 100, "hard": 1}  # steps over which an action is held


def measure() -> list[dict[str, Any]]:
    """Steps per second (lanes counted) of each way to run the environments, and the CPU time [us] of one step, which
    other work on the machine changes less; None of other processes.

    Easy: an action is held over 100 steps. Hard: every step has another one, white noise, which makes the engine take
    ten times as many attempts a period. 4096 lanes are worth a second core. Bench: decisions of 5 ms of JackBench.
    Platform: steps of Hexapod, five control periods of six jacks each.
    """
    rows = []
    for name, held in _HELD.items():
        pair = AsyncVectorEnv([_maker()] * 2)
        rows += [
            {"name": f"single, {name}", **_single(held)},
            *({"name": f"vector {lanes}, {name}", **_vector(_lanes(lanes), held)} for lanes in (256, 4096)),
            {"name": f"AsyncVectorEnv of 2, {name}", **_vector(pair, held), "cpu_us_per_step": None},
        ]
    bench, platform = (gymnasium.make_vec(f"{envs.__name__}:{name}-v0", 256) for name in ("JackBench", "Hexapod"))
    rows += [{"name": "bench 256, hard", **_vector(bench, 1)}]
    return [*rows, *({"name": f"platform 256, {name}", **_vector(platform, held)} for name, held in _HELD.items())]


def _maker() -> Callable[[], gymnasium.Env]:
    return lambda: gymnasium.make(_ID)


def _lanes(count: int) -> gymnasium.vector.VectorEnv:
    return gymnasium.make_vec(_ID, count)


def _single(held: int) -> dict[str, float]:
    env = gymnasium.make(_ID)
    env.reset(seed=0)
    actions = _actions(1, held)

    def step(count: int) -> None:
        _, _, ended, cut, _ = env.step(actions[count % len(actions)][0])
        if ended or cut:
            env.reset()

    speed = _timed(step, 1)
    env.close()
    return speed


def _vector(env: gymnasium.vector.VectorEnv, held: int) -> dict[str, float]:
    env.reset(seed=0)
    actions = _actions(env.num_envs, held, flatdim(env.single_action_space))
    speed = _timed(lambda count: env.step(actions[count % len(actions)]), env.num_envs)
    env.close()
    return speed


def _timed(step: Callable[[int], object], lanes: int) -> dict[str, float]:
    """The time of steps of so many lanes, each told its number, over some seconds."""
    count, began, spent = 0, perf_counter(), process_time()
    while perf_counter() - began < _SECONDS:
        step(count)
        count += 1
    steps, took, spent = count * lanes, perf_counter() - began, process_time() - spent
    return {"steps_per_second": steps / took, "cpu_us_per_step": 1e6 * spent / steps}


def _actions(lanes: int, held: int, own: int = 1) -> np.ndarray:
    drawn = 0.02 * np.random.default_rng(0).standard_normal((1000 // held, lanes, own))
    return np.repeat(drawn, held, axis=0).astype(np.float32)
