"""Stable-Baselines3 on the native vector environment: the same as its own way over single ones."""

import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from test_vector_env import actions_of, short

from envs.single import JackPosition
from envs.vector import JackPositionVector
from workbench.base.errors import InputError
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.robustness.options import RobustnessConfig


@pytest.fixture
def sb3():
    return pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed")


def lanes_of(path, lanes):
    from envs.stable_baselines import StableBaselinesLanes

    return StableBaselinesLanes(JackPositionVector(lanes, path, "SameStep"))


def test_lanes_are_those_of_single_environments_bit_for_bit(sb3, tmp_path):
    path = short(tmp_path)
    ours, theirs = lanes_of(path, 3), sb3.common.vec_env.DummyVecEnv([lambda: JackPosition(path)] * 3)
    for each in (ours, theirs):
        each.seed(4)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    ends = 0
    for actions in actions_of(3, 100):
        got, wanted = ours.step(actions), theirs.step(actions)
        for mine, other in zip(got[:3], wanted[:3], strict=True):
            assert mine.dtype == other.dtype
            np.testing.assert_array_equal(mine, other)
        for lane in np.flatnonzero(got[2]):
            ends += 1
            for key in ("terminal_observation", "TimeLimit.truncated"):
                np.testing.assert_array_equal(got[3][lane][key], wanted[3][lane][key])
    assert ends >= 9


def test_ppo_learns_on_it(sb3, tmp_path):
    env = sb3.common.vec_env.VecMonitor(lanes_of(short(tmp_path), 4))
    model = sb3.PPO("MlpPolicy", env, n_steps=40, batch_size=80, n_epochs=1, seed=0, device="cpu")
    model.learn(320)
    assert model.num_timesteps == 320
    assert len(model.ep_info_buffer) >= 4
    assert np.isfinite(model.predict(env.reset())[0]).all()


@pytest.mark.usefixtures("sb3")
def test_environments_that_reset_in_the_next_step_are_refused(tmp_path):
    from envs.stable_baselines import StableBaselinesLanes

    with pytest.raises(InputError, match="same step"):
        StableBaselinesLanes(JackPositionVector(2, short(tmp_path)))


def test_without_it_one_line_says_what_to_install():
    code = "import sys; sys.modules['stable_baselines3'] = None; import envs.stable_baselines"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "InputError: Stable-Baselines3 is not installed; pip install 'jackbench[rl]'" in done.stderr


@pytest.mark.usefixtures("sb3")
def test_the_example_trains_and_leaves_what_run_and_robustness_take(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    script = Path(__file__).parents[1] / "examples" / "rl" / "ppo_on_p_dp.py"
    monkeypatch.setattr(sys, "argv", [str(script), "1"])  # a rollout is the least
    runpy.run_path(str(script), run_name="__main__")
    assert "| p-dp + PPO |" in capsys.readouterr().out
    assert "network 9-16-16-1" in repr(load_steps("out/ppo/trained.toml").controllers[0])
    assert len(RobustnessConfig.load("out/ppo/robustness.toml").controllers) == 1
