"""What passes between an agent and a jack: observations, guard, sensors, the loop that an episode is."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from made_tasks import hold_at, make

from envs.single import JackPosition
from workbench.loop.sampled_loop import SampledLoop


@pytest.mark.parametrize("task", ["position", "force-moving-end"])
def test_observations_stay_in_their_space_whatever_the_agent_does(task):
    env = make(task)

    @settings(max_examples=12)
    @given(
        st.integers(0, 2**31),
        st.lists(st.floats(-3, 3) | st.sampled_from([-1.0, 1.0, np.inf, np.nan]), min_size=1, max_size=60),
    )
    def check(seed, actions):
        observation, _ = env.reset(seed=seed)
        assert observation in env.observation_space
        for action in actions:
            observation, reward, terminated, truncated, info = env.step(np.array([action]))
            assert observation in env.observation_space
            assert np.isfinite(reward)
            assert abs(info["command"]) <= 1
            if terminated or truncated:
                break

    check()


class Proportional:
    measures = ("position",)

    def reset(self, reference, measurement, command):
        pass

    def compute(self, reference, measurement):
        return 20 * (reference - measurement["position"])

    def update(self, realised):
        pass


class Constant(Proportional):
    def compute(self, reference, measurement):
        return 0.5


@pytest.mark.parametrize("law", [Proportional(), Constant()])
def test_an_episode_is_a_loop_of_the_workbench_to_its_trip(rig, engine, rest, written, law):
    env = JackPosition(written("position", **hold_at(10)))
    env.reset(seed=0)
    place, info = env.core.plant.state("x"), {}
    positions, commands = [], []
    while "trip" not in info and len(commands) < 150:
        positions.append(env.core.loops.x[0, place])
        action = law.compute(0.01, {"position": positions[-1]})
        info = env.step(np.array([action]))[4]
        commands.append(info["command"])
    run = SampledLoop(engine, rig, law, rest).run(np.full(len(commands), 0.01))
    np.testing.assert_allclose(positions, run.record.signals["position"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(commands, run.record.signals["command"], rtol=1e-6, atol=1e-9)
    assert info.get("trip") == run.tripped
    assert (run.tripped is None) == (len(commands) == 150) == (type(law) is Proportional)
    assert max(commands) > 0.19


def test_an_agent_sees_what_the_guard_reads_of_the_sensors(rig):
    """Noise and resolution of each sensor, and none of another: what is observed less what is true, scaled back."""
    env, seen, true = make("position-sensors"), [], []
    observation, _ = env.reset(seed=0)
    core = env.core
    for _ in range(300):
        seen.append(
            [value * each.full_scale + each.zero for value, each in zip(observation, core.channels, strict=True)]
        )
        true.append(core.plant.observe(core.loops.x, core.loops.u, core.loops.p)[0])
        observation, *_ = env.step(np.zeros(1))
    for column, channel in enumerate(core.channels[3:], 3):
        sensor, values = rig.sensors[channel.name], np.array(seen)[:, column]
        noise = values - np.array(true)[:, core.plant.output(channel.name)]
        assert np.std(noise) == pytest.approx(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12)), rel=0.15)
        assert values / sensor.resolution == pytest.approx(np.round(values / sensor.resolution), abs=0.02)
