"""Environments on a pump drive: checked by Gymnasium, followed by its tuned law, drawn alike in lanes."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from envs.single import JackPosition
from envs.vector import JackPositionVector

GAIN, FULL_SCALE = 752.0, 5e-3  # 1/m, of experiments/pump_step.toml; m, of the observed error


def test_gymnasium_has_nothing_to_say():
    check_env(gymnasium.make("envs:JackPosition-v0", task="pump").unwrapped, skip_render_check=True)


@pytest.mark.parametrize("seed", range(3))
def test_the_tuned_law_follows_and_nothing_trips(seed):
    env = JackPosition("pump")
    errors = []  # m
    observed, _ = env.reset(seed=seed)
    ends = False
    while not ends:
        command = np.clip(GAIN * FULL_SCALE * observed[1], -1, 1)
        observed, _, trips, ends, info = env.step(np.array([command], dtype=np.float32))
        assert not trips
        errors.append(abs(info["error"]))
    assert len(errors) == 200
    assert np.median(errors) < 0.3e-3


def test_lanes_are_the_single_environment():
    many = JackPositionVector(2, "pump")
    one = JackPosition("pump")
    first, _ = many.reset(seed=[4, 5])
    alone, _ = one.reset(seed=4)
    assert first[0] == pytest.approx(alone, abs=1e-6)
    for k in range(20):
        action = np.full((2, 1), 0.5 * np.sin(0.4 * k), dtype=np.float32)
        together, *_ = many.step(action)
        alone, *_ = one.step(action[0])
        assert together[0] == pytest.approx(alone, abs=1e-5)
