"""Hexapod-v0: what Gymnasium asks of an environment, and that a law brings the platform where it is asked to be."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from envs.hexapod import LEGS
from workbench import InputError
from workbench.rigs.platform import leg_speeds, load_platform


@pytest.fixture(scope="module")
def env():
    return gymnasium.make("envs:Hexapod-v0").unwrapped


@pytest.mark.filterwarnings("ignore:.*spec.*:UserWarning")
def test_gymnasium_finds_nothing_wrong(env):
    check_env(env, skip_render_check=True)


def test_an_episode_is_that_of_its_seed(env):
    first, _ = env.reset(seed=3)
    other, _ = env.reset(seed=4)
    again, info = env.reset(seed=3)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.abs(info["error"]).max() <= 0.02
    assert first[6:12] == pytest.approx(np.zeros(6), abs=1e-6)


def test_a_law_on_the_legs_brings_the_platform_into_its_pose(env):
    """Errors of the legs by the Jacobian, damped by what their load pressures are beyond those at rest."""
    slopes = leg_speeds(load_platform("hexapod").geometry, np.zeros(6))
    observation, info = env.reset(seed=5)
    rest, began, rewards, truncated = observation[18:24], np.abs(info["error"]).max(), [], False
    while not truncated:
        action = 3.0 * slopes @ info["error"] - 0.046 * (observation[18:24] - rest)
        observation, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        assert not terminated
    assert len(rewards) == 200
    assert np.abs(info["error"]).max() < 0.1 * began
    assert rewards[-1] > 0.2 * rewards[0]
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(LEGS))


def test_a_leg_that_runs_away_ends_the_episode(env):
    env.reset(seed=1)
    terminated, reward, info = False, 0.0, {}
    while not terminated:
        _, reward, terminated, truncated, info = env.step(np.ones(LEGS))
        assert not truncated
    assert reward < -90
    assert info["trip"].startswith("leg ")


def test_there_are_no_options(env):
    with pytest.raises(InputError, match="unknown option"):
        env.reset(options={"pose": 1})
