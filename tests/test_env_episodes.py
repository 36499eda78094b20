"""Episodes of one jack: their rewards, and how they begin and end."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from made_tasks import hold_at, make, mm, table_of

from envs.single import JackForce, JackPosition
from workbench.base.errors import InputError
from workbench.rigs.rig_file import save_rig


@pytest.fixture(scope="module")
def position():
    return make("position")


def test_reward_is_the_sum_of_its_terms(written):
    reward = {
        "tracking": {"weight": 2, "per": 5, "unit": "mm"},
        "effort": {"weight": 3, "per": 50, "unit": "%"},
        "change": {"weight": 5, "per": 100, "unit": "1/s"},
    }
    env = JackPosition(written("position", reward=reward, **hold_at(10)))
    env.reset(seed=0)
    before = 0.0
    for demanded in (0.1, 0.6, -0.2):
        _, paid, _, _, info = env.step(np.array([demanded]))
        u, rate = info["command"], (info["command"] - before) / 1e-3
        assert rate == pytest.approx(np.clip(demanded - before, -0.2, 0.2) / 1e-3)
        assert paid == pytest.approx(-(2 * abs(info["error"]) / 5e-3 + 3 * (u / 0.5) ** 2 + 5 * (rate / 100) ** 2))
        before = u


def test_several_control_periods_are_one_step_with_their_mean_reward(written):
    fine = JackPosition(written("position", **hold_at(10)))
    coarse = JackPosition(written("position", control_periods=3, **hold_at(10)))
    fine.reset(seed=0)
    coarse.reset(seed=0)
    for _ in range(4):
        parts = [fine.step(np.array([0.5])) for _ in range(3)]
        whole = coarse.step(np.array([0.5]))
        np.testing.assert_array_equal(whole[0], parts[-1][0])
        assert whole[1] == pytest.approx(np.mean([part[1] for part in parts]))
        assert whole[4] == parts[-1][4]


def drive(env, action, most=2000):
    """Last step of an episode under one action."""
    for count in range(1, most):
        stepped = env.step(np.array([action]))
        if stepped[2] or stepped[3]:
            return count, stepped
    raise AssertionError("the episode goes on and on")


def test_trip_terminates_says_why_and_costs(written):
    quiet = {key: {"weight": 0} for key in ("effort", "change")}
    table = table_of("position")["reward"]
    quiet = {key: {**table[key], **value} for key, value in quiet.items()}
    env = JackPosition(written("position", reward=quiet, **hold_at(10)))
    env.reset(seed=0)
    _, (_, reward, terminated, truncated, info) = drive(env, 0.5)
    assert (terminated, truncated, info["trip"]) == (
        True,
        False,
        "too fast to stop within +-240 mm of mid stroke",
    )
    assert reward == pytest.approx(-100 - 0.01 * abs(info["error"]) / 0.01)
    assert abs(env.core.loops.x[0, env.core.plant.state("x")]) < 0.24  # the guard saw it coming
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0.0]))
    assert "trip" not in env.reset()[1]
    assert not env.step(np.array([0.0]))[2]


def test_force_limit_terminates():
    env = make("force")
    env.reset(seed=0)
    assert drive(env, 1.0)[1][4]["trip"] == "force above 90 kN"


def test_action_that_is_not_finite_terminates(position):
    position.reset(seed=0)
    stepped = position.step(np.array([np.nan]))
    assert stepped[2]
    assert stepped[4]["trip"] == "the controller's command is not finite"


def test_end_stop_terminates(written, tmp_path, rig):
    limits = {**rig.limits, "stroke": replace(rig.limits["stroke"], value=1.0)}
    numbers = {**rig.numbers, "S": replace(rig.numbers["S"], low=0.5, high=2.0)}  # as far as the file knows
    save_rig(replace(rig, limits=limits, numbers=numbers), tmp_path / "loose.toml")
    env = JackPosition(written("position", rig="loose.toml", **hold_at(10)))
    env.reset(seed=0)
    _, (_, _, terminated, _, info) = drive(env, 0.5)
    assert (terminated, info["trip"]) == (True, "the jack met its end stop")
    assert env.core.loops.x[0, env.core.plant.state("x")] >= 0.25


def test_failed_simulation_terminates_at_the_last_state():
    env = make("position")
    env.reset(seed=0)
    env.step(np.array([0.1]))
    core, x = env.core, env.core.loops.x.copy()
    core.loops.p[0, core.plant.parameters.index("beta")] = np.nan
    observation, reward, terminated, _, info = env.step(np.array([0.1]))
    assert (terminated, info["trip"]) == (True, "the simulation failed")
    assert observation in env.observation_space
    assert reward < -90
    np.testing.assert_array_equal(core.loops.x, x)
    assert not env.reset()[1].keys() & {"trip"}
    assert not env.step(np.array([0.1]))[2]


def test_time_limit_truncates(written):
    env = JackPosition(written("position", episode={"value": 12, "unit": "ms"}))
    env.reset(seed=0)
    count, (_, _, terminated, truncated, info) = drive(env, 0.0)
    assert (count, terminated, truncated) == (12, False, True)
    assert "trip" not in info
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0.0]))


def test_step_before_reset_and_reset_options_are_refused():
    env = gymnasium.make("JackPosition-v0", disable_env_checker=True)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0.0]))
    with pytest.raises(InputError, match='unknown option "speed"'):
        env.reset(options={"speed": 1})


def test_specimen_is_unloaded_at_the_start_and_its_end_moves(written):
    end = {"travel": mm(2, 2), "frequency": {"low": 10, "high": 10, "unit": "Hz"}}
    rigid = {"low": 1e6, "high": 1e6, "unit": "N/m"}
    env = JackForce(written("force", randomise=False, specimen={"stiffness": rigid, "end": end}))
    env.reset(seed=0)
    core = env.core
    force, (ks, cs) = (
        core.plant.output("force"),
        (core.loops.p[0, core.plant.parameters.index(name)] for name in ("ks", "cs")),
    )
    start = core.loops.x[0, core.plant.state("x")]
    assert core.plant.observe(core.loops.x, core.loops.u)[0, force] == 0
    for k in range(1, 20):
        env.step(np.array([0.0]))
        t = k * 1e-3
        far = start + 1e-3 * (1 - np.cos(2 * np.pi * 10 * t))
        speed = 1e-3 * 2 * np.pi * 10 * np.sin(2 * np.pi * 10 * t)
        x, v = core.loops.x[0, core.plant.state("x")], core.loops.x[0, core.plant.state("v")]
        seen = core.plant.observe(core.loops.x, core.loops.u, core.loops.p[0])[0, force]
        assert seen == pytest.approx(ks * (x - far) + cs * (v - speed), rel=1e-9)
