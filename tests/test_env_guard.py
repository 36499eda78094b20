"""What passes between an agent and a jack: observations, guard, sensors, the loop that an episode is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_tasks import hold_at, make

from envs.lane_guard import LaneGuard, Trip
from envs.sensing import LaneSensors
from envs.single import JackPosition
from workbench.loop.guard import Guard
from workbench.loop.sampled_loop import SampledLoop
from workbench.rigs.rig_file import load_rig


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


@settings(max_examples=60)
@given(st.data())
def test_lane_guard_trips_only_where_the_guard_does_and_limits_alike(data):
    rig, lanes, names = load_rig("jack-10t"), 3, ("pa", "position", "force")
    guards, together = [Guard(rig) for _ in range(lanes)], LaneGuard(rig, names, lanes)
    for guard in guards:
        guard.reset(0.1)
    together.reset(np.arange(lanes), 0.1)
    odd = st.sampled_from([np.nan, np.inf])
    signals = st.tuples(
        st.floats(0, 3e7) | odd, st.floats(-4e-3, 4e-3) | st.floats(-0.25, 0.25), st.floats(-9.1e4, 9.1e4)
    )
    demands = st.floats(-2, 2) | odd | st.just(1e200)
    for _ in range(data.draw(st.integers(1, 8))):
        measured = np.array(data.draw(st.tuples(*[signals] * lanes)))
        demanded = np.array(data.draw(st.tuples(*[demands] * lanes)))
        together.watch(measured)
        got = together.limit(demanded)
        for lane, guard in enumerate(guards):
            guard.watch(dict(zip(names, measured[lane].tolist(), strict=True)))
            sent = guard.limit(float(demanded[lane]))
            if guard.tripped is None:
                assert got[lane] == sent
                assert together.trip[lane] == Trip.NONE


def test_sensors_hiss_and_round_as_the_rig_says(rig):
    outputs = ("position", "velocity", "pa")
    sensors, ideal = LaneSensors(rig, outputs, ideal=False), LaneSensors(rig, outputs, ideal=True)
    true, count = np.tile([0.1, 2.0, 1e7], (4000, 1)), 4000
    noise = np.random.default_rng(0).standard_normal((count, 2)) * sensors.noise
    seen = sensors.read(true, noise, np.arange(count))
    assert sensors.names == ("position", "pa")
    np.testing.assert_array_equal(ideal.read(true, noise, np.arange(count)), true[:, [0, 2]])
    for column, name in enumerate(sensors.names):
        sensor = rig.sensors[name]
        counts = seen[:, column] / sensor.resolution
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        assert np.std(seen[:, column]) == pytest.approx(sensor.noise, rel=0.05)


class Proportional:
    measures = ("position",)

    def reset(self, reference, measurement, command):
        pass

    def compute(self, reference, measurement):
        return 20 * (reference - measurement["position"])

    def update(self, realised):
        pass


def test_an_episode_is_a_loop_of_the_workbench(rig, engine, rest, written):
    path = written("position", **hold_at(10))
    env = JackPosition(path)
    env.reset(seed=0)
    steps, place = 100, env.core.plant.state("x")
    positions, commands = [], []
    for _ in range(steps):
        positions.append(env.core.x[0, place])
        info = env.step(np.array([20 * (0.01 - positions[-1])]))[4]
        commands.append(info["command"])
    run = SampledLoop(engine, rig, Proportional(), rest).run(np.full(steps, 0.01))
    np.testing.assert_allclose(positions, run.record.signals["position"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(commands, run.record.signals["command"], rtol=1e-6, atol=1e-9)
    assert max(commands) > 0.19
