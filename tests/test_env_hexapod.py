"""Hexapod-v0: what Gymnasium asks of an environment, and that a law brings the platform where it is asked to be."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from envs.hexapod import Hexapod, HexapodVector
from workbench import InputError
from workbench.rigs.platform import LEGS, leg_speeds, load_platform


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


@pytest.fixture(scope="module", params=[True, False], ids=["ideal", "sensors"])
def pair(request):
    """One lane and three, by the same sensors."""
    return Hexapod(ideal=request.param), HexapodVector(3, ideal=request.param)


def test_a_lane_does_what_a_platform_alone_does(pair):
    """Of each seed, through a trip of one lane and the episodes after it."""
    one, lanes = pair
    actions = 0.05 * np.random.default_rng(0).standard_normal((30, 3, LEGS))
    actions[5:, 1] = 1.0
    shown, _ = lanes.reset(seed=7)
    steps = [lanes.step(each) for each in actions]
    assert any(terminated[1] for _, _, terminated, _, _ in steps)
    for lane in range(3):
        assert np.array_equal(one.reset(seed=7 + lane)[0], shown[lane])
        over = False
        for action, (observation, reward, terminated, _, infos) in zip(actions, steps, strict=True):
            own = (one.reset()[0], 0.0, False, False, {}) if over else one.step(action[lane])
            over = own[2]
            assert observation[lane] == pytest.approx(own[0], abs=1e-6)
            assert (reward[lane], terminated[lane]) == (pytest.approx(own[1], rel=1e-9), own[2])
            if over:
                assert infos["trip"][lane] == own[4]["trip"]


def test_an_episode_begins_anew_in_the_step_that_ended_it():
    lanes = HexapodVector(2, autoreset_mode="SameStep")
    first, _ = lanes.reset(seed=1)
    steps = [lanes.step(np.zeros((2, LEGS))) for _ in range(200)]
    observation, _, terminated, truncated, infos = steps[-1]
    assert truncated.all()
    assert not terminated.any()
    assert infos["final_obs"][0].shape == (30,)
    assert not np.array_equal(observation, first)
    assert np.abs(infos["final_info"]["error"]).max() <= 0.021


def test_what_sensors_say_scatters_as_they_do():
    """Positions of the legs by their noise and resolution; at rest nothing turns."""
    ideal, sensed = Hexapod(), Hexapod(ideal=False)
    rig = load_platform("hexapod").legs[0].rig
    shown = [sensed.reset(seed=seed)[0] - ideal.reset(seed=seed)[0] for seed in range(100)]
    sensor = rig.sensors["position"]
    read = np.std([each[12:18] for each in shown]) * rig.limit("stroke")
    assert read == pytest.approx(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12)), rel=0.15)
    assert all(np.abs(each[6:12]).max() < 1e-6 for each in shown)


def test_commands_come_late_where_the_drives_are():
    moved = {}
    for ideal in (True, False):
        platform = Hexapod(ideal=ideal)
        _, begun = platform.reset(seed=0)
        _, _, _, _, info = platform.step(np.full(LEGS, 0.2))
        moved[ideal] = abs(info["error"][2] - begun["error"][2])
    assert moved[False] < 0.8 * moved[True]
