"""The environments of one jack: Gymnasium's contract, tasks, references, guard, rewards and ends."""

import re
import subprocess
import sys
import tomllib
import warnings
from dataclasses import replace
from importlib.resources import files

import gymnasium
import numpy as np
import pytest
import tomli_w
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

import envs
from envs.core import Core
from envs.lane_guard import LaneGuard, Trip
from envs.references import FAMILIES, Multisine, Ramps, Range, Sines, Steps
from envs.registration import IDS
from envs.sensing import LaneSensors
from envs.single import JackForce, JackPosition
from envs.task import bundled, load_task
from workbench.errors import InputError
from workbench.guard import Guard
from workbench.loop import ClosedLoop
from workbench.rig import EffectUse, Number, load_rig, save_rig

TASKS = {"position": "position", "position-sensors": "position", "force": "force", "force-moving-end": "force"}
REASONS = {
    "signal is not finite": Trip.SIGNAL, "position beyond": Trip.STROKE, "speed above": Trip.SPEED,
    "force above": Trip.FORCE, "command is not finite": Trip.ACTION,
}  # fmt: skip


def make(task):
    return (JackPosition if "force" not in str(task) else JackForce)(task)


@pytest.fixture
def written(tmp_path):
    """A bundled task with some tables or values replaced (None: left out), as a file."""

    def write(name, /, **changes):
        table = tomllib.loads((files("envs") / "tasks" / f"{name}.toml").read_text())
        for key, value in changes.items():
            if value is None:
                table.pop(key)
            else:
                table[key] = {**table[key], **value} if isinstance(value, dict) and key != "references" else value
        path = tmp_path / f"{name}-changed.toml"
        path.write_text(tomli_w.dumps(table))
        return path

    return write


def mm(low, high):
    return {"low": low, "high": high, "unit": "mm"}


def hold_at(size):
    """A reference that steps to one place and stays, and a start at mid stroke."""
    steps = {"weight": 1, "size": mm(size, size), "hold": {"low": 1, "high": 1, "unit": "s"}}
    return {"randomise": False, "start": mm(0, 0), "references": {"steps": steps}}


@pytest.fixture(scope="module")
def position():
    return make("position")


# the contract


@pytest.mark.parametrize("name", IDS)
def test_gymnasium_checker_is_content(name):
    with warnings.catch_warnings(record=True) as complaints:
        warnings.simplefilter("always")
        check_env(gymnasium.make(name).unwrapped)
    assert not complaints


@pytest.mark.parametrize("task", TASKS)
def test_stable_baselines_checker_is_content(task):
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="stable-baselines3 is not installed")
    checker.check_env(make(task))


def test_every_bundled_task_is_tested():
    assert bundled() == sorted(TASKS)


def test_registered_once_and_found_by_the_module_in_the_name():
    before = dict(gymnasium.registry)
    envs.register()
    assert dict(gymnasium.registry) == before
    assert python("import gymnasium; print(gymnasium.make('envs:JackForce-v0').unwrapped.loop)") == "force"


def test_importing_the_package_does_not_load_the_plant():
    assert python("import envs, sys; print('casadi' in sys.modules)") == "False"


def python(code):
    """What a new interpreter prints."""
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.parametrize(("kind", "tasks"), [(JackPosition, TASKS), (JackForce, TASKS)])
def test_docstring_tables_are_the_channels(kind, tasks):
    rows = re.findall(r"^ *\| (\d+) \| (\w+) \| ([^|]+) \|", kind.__doc__, re.MULTILINE)
    wanted = []
    for task in (name for name, loop in tasks.items() if loop == kind.loop):
        channels = Core(load_task(task, kind.loop), 1).channels
        wanted += [(str(i), channel.name, channel.shown) for i, channel in enumerate(channels)]
    assert rows == wanted


@pytest.mark.parametrize("kind", [JackPosition, JackForce])
def test_docstring_weights_rates_and_times_are_those_of_the_bundled_tasks(kind):
    for name in (name for name, loop in TASKS.items() if loop == kind.loop):
        task = load_task(name, kind.loop)
        per = 1e-2 if kind.loop == "position" else 1e4
        assert (task.reward.tracking * per, task.reward.effort) == pytest.approx((0.01, 0.001))
        assert (task.reward.change * 100**2, task.reward.trip) == pytest.approx((0.001, 100))
        assert (task.episode, task.start, task.rig.name) == (1.0, Range(-0.05, 0.05), "jack-10t")
        assert (task.rig.limit("command_rate"), task.rig.period.value) == (200, 1e-3)


# seeding and independence


def rollout(env, seed, actions):
    observation, info = env.reset(seed=seed)
    seen = [observation, info["error"]]
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(np.array([action], np.float32))
        seen += [observation, reward, terminated, truncated, info["error"], info["command"]]
        if terminated or truncated:
            break
    return np.concatenate([np.ravel(value) for value in seen])


@pytest.mark.parametrize("task", TASKS)
def test_seed_decides_everything(task):
    env, actions = make(task), np.sin(np.arange(25) / 3)
    first = rollout(env, 7, actions)
    np.testing.assert_array_equal(first, rollout(env, 7, actions))
    np.testing.assert_array_equal(first, rollout(make(task), 7, actions))
    assert not np.array_equal(first, rollout(env, 8, actions))


def test_reset_without_seed_goes_on_to_another_episode(position):
    first, _ = position.reset(seed=1)
    second, _ = position.reset()
    third, _ = position.reset(seed=1)
    np.testing.assert_array_equal(first, third)
    assert not np.array_equal(first, second)


def test_two_environments_share_nothing():
    alone, actions = rollout(make("position"), 3, np.full(20, 0.3)), np.full(20, 0.3)
    one, other = make("position"), make("position")
    one.reset(seed=3)
    other.reset(seed=4)
    seen = []
    for action in actions:
        seen.append(one.step(np.array([action], np.float32))[0])
        other.step(np.array([-action], np.float32))
    np.testing.assert_array_equal(np.float32(alone[-len(seen[-1]) - 5 : -5]), seen[-1])


def test_what_was_returned_is_never_touched_again(position):
    first, _ = position.reset(seed=0)
    kept = [(first, first.copy())]
    for _ in range(5):
        observation = position.step(np.array([1.0]))[0]
        kept.append((observation, observation.copy()))
    for observation, copy in kept:
        np.testing.assert_array_equal(observation, copy)


def test_rig_numbers_are_drawn_within_their_bounds_or_left_alone(written):
    core = Core(load_task("force", "force"), 40)
    core.reset([np.random.default_rng(i) for i in range(40)])
    rig, names = core.task.rig, core.plant.parameters
    drawn = {name for i, name in enumerate(names) if np.ptp(core.p[:, i]) > 0}
    assert drawn == {name for name, n in rig.numbers.items() if n.low is not None} | {"ks", "cs"}
    for name, n in rig.numbers.items():
        if n.low is not None:
            values = core.p[:, names.index(name)]
            assert n.low <= values.min() < values.max() <= n.high
    still = Core(load_task(written("position", randomise=False), "position"), 3)
    still.reset([np.random.default_rng(i) for i in range(3)])
    np.testing.assert_array_equal(still.p, np.tile(still.plant.p, (3, 1)))


def test_numbers_of_effects_are_drawn_within_their_bounds(rig, written, tmp_path):
    friction = EffectUse("jack.friction", "coulomb", {"Fc": Number("Fc", 1, "kN", "kN", "", 0.5, 2)})
    save_rig(replace(rig, effects=(friction,)), tmp_path / "rough.toml")
    core = Core(load_task(written("position", rig="rough.toml"), "position"), 30)
    core.reset([np.random.default_rng(i) for i in range(30)])
    drawn = core.p[:, core.plant.parameters.index("jack.friction.Fc")]
    assert 500 <= drawn.min() < 900 < 1600 < drawn.max() <= 2000


# bounds, guard and loop


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


def reason_of(text):
    return next(trip for words, trip in REASONS.items() if words in text) if text else Trip.NONE


@settings(max_examples=60)
@given(st.data())
def test_lane_guard_decides_as_the_guard_does(data):
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
            assert got[lane] == guard.limit(float(demanded[lane]))
            assert together.trip[lane] == reason_of(guard.tripped)


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
    run = ClosedLoop(engine, rig, Proportional(), rest).run(np.full(steps, 0.01))
    np.testing.assert_allclose(positions, run.record.signals["position"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(commands, run.record.signals["command"], rtol=1e-6, atol=1e-9)
    assert max(commands) > 0.19


# rewards and ends


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
    table = tomllib.loads((files("envs") / "tasks" / "position.toml").read_text())["reward"]
    quiet = {key: {**table[key], **value} for key, value in quiet.items()}
    env = JackPosition(written("position", reward=quiet, **hold_at(10)))
    env.reset(seed=0)
    _, (_, reward, terminated, truncated, info) = drive(env, 0.5)
    assert (terminated, truncated, info["trip"]) == (True, False, Trip.STROKE.reason)
    assert reward == pytest.approx(-100 - 0.01 * abs(info["error"]) / 0.01)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0.0]))
    assert "trip" not in env.reset()[1]
    assert not env.step(np.array([0.0]))[2]


def test_force_limit_terminates():
    env = make("force")
    env.reset(seed=0)
    assert drive(env, 1.0)[1][4]["trip"] == Trip.FORCE.reason


def test_action_that_is_not_finite_terminates(position):
    position.reset(seed=0)
    stepped = position.step(np.array([np.nan]))
    assert stepped[2]
    assert stepped[4]["trip"] == Trip.ACTION.reason


def test_end_stop_terminates(written, tmp_path, rig):
    limits = {**rig.limits, "stroke": replace(rig.limits["stroke"], value=1.0)}
    save_rig(replace(rig, limits=limits), tmp_path / "loose.toml")
    env = JackPosition(written("position", rig="loose.toml", **hold_at(10)))
    env.reset(seed=0)
    _, (_, _, terminated, _, info) = drive(env, 0.5)
    assert (terminated, info["trip"]) == (True, Trip.END_STOP.reason)
    assert env.core.x[0, env.core.plant.state("x")] >= 0.25


class Broken:
    """Physics that fails in every lane whose command is beyond 0.5."""

    def __init__(self, real):
        self._real = real

    def advance(self, x, u, p, duration):
        after, failed = self._real.advance(x, u, p, duration)
        bad = u[:, 0] > 0.5
        after[bad] = np.nan
        return after, failed | bad

    def observe(self, x, u, p):
        assert np.isfinite(x).all()
        return self._real.observe(x, u, p)

    def advance_one(self, x, u, p, duration):
        return None if u[0] > 0.5 else self._real.advance_one(x, u, p, duration)

    def observe_one(self, x, u, p):
        return self._real.observe_one(x, u, p)


def test_failed_simulation_terminates_at_the_last_state(position):
    env = make("position")
    env.core._physics = Broken(env.core._physics)
    env.reset(seed=0)
    _, (observation, reward, terminated, _, info) = drive(env, 1.0)
    assert (terminated, info["trip"]) == (True, Trip.SIMULATION.reason)
    assert observation in env.observation_space
    assert np.isfinite(reward)


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
        (core.p[0, core.plant.parameters.index(name)] for name in ("ks", "cs")),
    )
    start = core.x[0, core.plant.state("x")]
    assert core.plant.observe(core.x, core.u)[0, force] == 0
    for k in range(1, 20):
        env.step(np.array([0.0]))
        t = k * 1e-3
        far = start + 1e-3 * (1 - np.cos(2 * np.pi * 10 * t))
        speed = 1e-3 * 2 * np.pi * 10 * np.sin(2 * np.pi * 10 * t)
        x, v = core.x[0, core.plant.state("x")], core.x[0, core.plant.state("v")]
        seen = core.plant.observe(core.x, core.u, core.p[0])[0, force]
        assert seen == pytest.approx(ks * (x - far) + cs * (v - speed), rel=1e-9)


# references


@given(st.sampled_from(sorted(FAMILIES)), st.integers(0, 2**31), st.floats(0.01, 3))
def test_references_keep_to_their_size(name, seed, last):
    size, hold, slow = Range(-0.02, 0.03), Range(0.05, 0.1), Range(0.5, 5.0)
    family = {
        "steps": Steps(size, hold), "ramps": Ramps(size, Range(0.1, 0.2), hold),
        "sines": Sines(size, slow), "multisine": Multisine(size, slow, 5),
    }[name]  # fmt: skip
    t = np.arange(0, last, 1e-3)
    values = family.make(np.random.default_rng(seed), t)
    assert values.shape == t.shape
    assert np.abs(values).max() <= family.size.largest * (1 + 1e-12)
    if name == "ramps":
        assert values[0] == 0
        assert np.abs(np.diff(values)).max(initial=0) <= 0.2 * 1e-3 * (1 + 1e-9)


def test_steps_hold_for_as_long_as_they_should():
    t = np.arange(0, 5, 1e-3)
    values = Steps(Range(-1, 1), Range(0.2, 0.4)).make(np.random.default_rng(0), t)
    holds = np.diff(np.flatnonzero(np.diff(values)))
    assert 199 <= holds.min() <= holds.max() <= 401


def test_families_are_drawn_by_weight(written):
    table = tomllib.loads((files("envs") / "tasks" / "position.toml").read_text())["references"]
    table["sines"]["weight"], table["ramps"]["weight"] = 0, 0
    core = Core(load_task(written("position", references=table), "position"), 1)
    drawn = {core._author.family(np.random.default_rng(seed)).__class__ for seed in range(60)}
    assert drawn == {Steps, Multisine}


# task files


def broken(written, name="position", **changes):
    with pytest.raises(InputError) as complaint:
        load_task(written(name, **changes), name)
    assert "\n" not in str(complaint.value)
    return str(complaint.value)


def test_unknown_keys_name_their_nearest(written):
    assert 'unknown key "episod"; did you mean "episode"?' in broken(written, episod=1)
    assert 'unknown key "stepz"; did you mean "steps"?' in broken(written, references={"stepz": {}})
    assert 'unknown key "trak"' in broken(written, reward={"trak": 1})
    assert "[observation]: sees: no such thing" in broken(written, observation={"sees": "ideals"})
    with pytest.raises(InputError, match=r'no bundled task "positon"; did you mean "position"'):
        load_task("positon", "position")


def test_wrong_values_are_refused_with_their_place(written):
    assert "start: low must not be above high" in broken(written, start=mm(2, 1))
    assert "start: write {low" in broken(written, start=[1, 2])
    assert "episode: unit" in broken(written, episode={"value": 1, "unit": "mm"})
    assert "episode: shorter than one step" in broken(written, episode={"value": 0.1, "unit": "ms"})
    assert "episode: value must be a positive number" in broken(written, episode={"value": 0, "unit": "s"})
    assert "control_periods: must be a whole number" in broken(written, control_periods=0)
    assert "randomise: must be true or false" in broken(written, randomise=1)
    assert "title is missing" in broken(written, title=None)
    assert "[reward]: effort: per must be a positive number" in broken(written, reward={"effort": {"weight": 1}})
    assert "specimen: a force loop needs" in broken(written, "force", specimen=None)
    assert "references: they reach past" in broken(written, **hold_at(250))
    assert "no family has one above 0" in broken(written, references={})
    assert "position sensor" in broken(written, rig=str(without_position_sensor(written)))


def without_position_sensor(written):
    rig = load_rig("jack-10t")
    path = written("position").parent / "blind.toml"
    save_rig(replace(rig, sensors={}), path)
    return path.name


def test_loop_of_another_environment_is_refused():
    with pytest.raises(InputError, match="closes the position loop"):
        JackPosition("force")


def test_another_kind_of_rig_runs(written):
    """A differential jack with a second-order valve and few sensors, whose position does not count from mid stroke."""
    changes = {"rig": "festo-tp511", "start": mm(-40, 40)}
    env = JackPosition(written("position", observation={"sees": "sensors"}, **changes))
    observation, _ = env.reset(seed=0)
    assert [c.name for c in env.core.channels] == ["reference", "error", "command", "pa", "pb", "position"]
    assert abs(observation[0]) <= 90 / 97
    assert observation[5] == pytest.approx(observation[0] - observation[1] * 10 / 97, abs=1e-5)
    env = JackPosition(written("position", **changes))  # without noise, which is more than its guard bears
    env.reset(seed=0)
    for _ in range(20):
        observation, _, terminated, _, _ = env.step(np.array([0.02]))
        assert not terminated
    assert env.core.x[0, env.core.plant.state("v")] > 0
