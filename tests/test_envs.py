"""The environments of one jack: Gymnasium's contract, and what a seed decides."""

import copy
import pickle
import re
import subprocess
import sys
import warnings
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import VectorEnv
from gymnasium.wrappers import RecordVideo
from made_tasks import TASKS, make, write_task
from test_bench_env import small

import envs
from envs import IDS
from envs.bench.environments import JackBenchVector
from envs.core import Core
from envs.hexapod import Hexapod, HexapodVector
from envs.references import Range
from envs.single import JackForce, JackPosition
from envs.task import bundled, load_task
from envs.vector import JackForceVector, JackPositionVector
from workbench.base.errors import InputError
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import save_rig


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


JACK = (1.0, Range(-0.05, 0.05), "jack-10t", 1)
PUMP = (5e-3, 4.0, Range(-0.01, 0.01), "pump-rig", 20)


@pytest.mark.parametrize("task", TASKS)
def test_stable_baselines_checker_is_content(task):
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="stable-baselines3 is not installed")
    checker.check_env(make(task))


@pytest.mark.parametrize("name", IDS)
def test_stable_baselines_checker_is_content_with_what_gymnasium_makes(name):
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="stable-baselines3 is not installed")
    checker.check_env(gymnasium.make(name).unwrapped)


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
        per, *rest = PUMP if name == "pump" else (1e-2 if kind.loop == "position" else 1e4, *JACK)
        assert (task.reward.tracking * per, task.reward.effort) == pytest.approx((0.01, 0.001))
        assert (task.reward.change * 100**2, task.reward.trip) == pytest.approx((0.001, 100))
        assert [task.episode, task.start, task.rig.name, task.control_periods] == rest
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
    for observation, same in kept:
        np.testing.assert_array_equal(observation, same)


def test_rig_numbers_are_drawn_within_their_bounds_or_left_alone(written):
    core = Core(load_task("force", "force"), 40)
    core.reset([np.random.default_rng(i) for i in range(40)])
    rig, names = core.task.rig, core.plant.parameters
    drawn = {name for i, name in enumerate(names) if np.ptp(core.loops.p[:, i]) > 0}
    assert drawn == {name for name, n in rig.numbers.items() if n.low is not None} | {"ks", "cs"}
    for name, n in rig.numbers.items():
        if n.low is not None:
            values = core.loops.p[:, names.index(name)]
            assert n.low <= values.min() < values.max() <= n.high
    still = Core(load_task(written("position", randomise=False), "position"), 3)
    still.reset([np.random.default_rng(i) for i in range(3)])
    np.testing.assert_array_equal(still.loops.p, np.tile(still.plant.p, (3, 1)))


def test_numbers_of_effects_are_drawn_within_their_bounds(rig, written, tmp_path):
    friction = EffectUse("jack.friction", "coulomb", {"Fc": Number("Fc", 1, "kN", "kN", "", 0.5, 2)})
    save_rig(replace(rig, effects=(friction,)), tmp_path / "rough.toml")
    core = Core(load_task(written("position", rig="rough.toml"), "position"), 30)
    core.reset([np.random.default_rng(i) for i in range(30)])
    drawn = core.loops.p[:, core.plant.parameters.index("jack.friction.Fc")]
    assert 500 <= drawn.min() < 900 < 1600 < drawn.max() <= 2000


# pictures


@pytest.mark.parametrize("name", [name for name in IDS if name.startswith("Jack")])
def test_pictures_show_the_jack_and_grow_with_the_episode(name):
    env = gymnasium.make(name, render_mode="rgb_array", disable_env_checker=True)
    env.reset(seed=0)
    first = env.render()
    assert isinstance(first, np.ndarray)
    assert (first.dtype, first.shape[2]) == (np.uint8, 3)
    for _ in range(20):
        env.step(np.array([0.01], np.float32))
    later = env.render()
    assert isinstance(later, np.ndarray)
    assert later.shape == first.shape
    assert (later != first).any()


def test_no_picture_without_its_mode_or_before_an_episode(position):
    assert position.render() is None
    with pytest.raises(InputError, match="render_mode = 'human'"):
        JackPosition(render_mode="human")
    with pytest.raises(gymnasium.error.ResetNeeded, match="no episode to draw"):
        JackPosition(render_mode="rgb_array").render()


@pytest.mark.parametrize("kind", [Hexapod, HexapodVector, JackPositionVector, JackForceVector, JackBenchVector])
def test_what_draws_nothing_refuses_a_render_mode_in_one_line(kind):
    with pytest.raises(InputError, match="render_mode = 'rgb_array': this environment draws no pictures; leave it out"):
        kind(render_mode="rgb_array")


def test_gymnasium_records_a_video(tmp_path):
    pytest.importorskip("moviepy", reason="moviepy is not installed")
    jack = gymnasium.make("JackPosition-v0", render_mode="rgb_array")
    env = RecordVideo(jack, str(tmp_path / "videos"), disable_logger=True)
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros(1, np.float32))
    env.close()
    assert [path.suffix for path in (tmp_path / "videos").iterdir() if path.stat().st_size] == [".mp4"]


# copies

COPIED = {
    "single": lambda folder: JackPosition(write_task(folder, "position-sensors", episode=FEW)),
    "late": lambda folder: JackPosition(late(folder)),
    "lanes": lambda folder: JackForceVector(3, write_task(folder, "force-moving-end", episode=FEW)),
    "platform": lambda folder: Hexapod(ideal=False),
    "bench": lambda folder: JackBenchVector(3, small(folder), past=2),
}
FEW = {"value": 30, "unit": "ms"}


def late(folder):
    """The task on a rig whose commands come 1.7 ms late."""
    use = EffectUse("drive.delay", "", {"delay": Number("delay", 1.7, "ms", "ms", "", None, None)})
    save_rig(replace(load_task("position", "position").rig, effects=(use,)), folder / "late.toml")
    return write_task(folder, "position", rig="late.toml", episode=FEW)


def told(env, actions):
    """Everything that an environment says to actions, as bytes; it begins anew where an episode is over."""
    said = []
    for action in actions:
        *arrays, infos = env.step(action)
        said += [np.asarray(each).tobytes() for each in arrays] + [repr(infos)]
        if not isinstance(env, VectorEnv) and (arrays[2] or arrays[3]):
            said.append(env.reset()[0].tobytes())
    return said


@pytest.mark.parametrize("name", COPIED)
def test_copies_in_the_middle_of_an_episode_go_on_to_the_bit(tmp_path, name):
    env = COPIED[name](tmp_path)
    env.reset(seed=3)
    random = np.random.default_rng(0)
    actions = [0.5 * random.uniform(-1, 1, env.action_space.shape).astype("f4") for _ in range(50)]
    told(env, actions[:11])
    twin, kept = copy.deepcopy(env), pickle.dumps(env)
    tried = told(twin, [-action for action in actions[:7]])  # a planner's try leaves the environment where it is
    back = pickle.loads(kept)
    assert told(copy.deepcopy(back), [-action for action in actions[:7]]) == tried
    twin = copy.deepcopy(env)
    expected = told(env, actions[11:])
    assert told(back, actions[11:]) == expected
    assert told(twin, actions[11:]) == expected


def test_a_pickled_environment_goes_on_in_another_process(tmp_path):
    env = COPIED["bench"](tmp_path)
    env.reset(seed=3)
    env.step(np.full((3, 1), 0.5, np.float32))
    (tmp_path / "env").write_bytes(pickle.dumps(env))
    code = "import pickle, sys; import numpy as np; env = pickle.load(open(sys.argv[1], 'rb'))"
    code += "; print(env.step(np.full((3, 1), -0.5, np.float32))[0].tobytes().hex())"
    ran = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "env"], capture_output=True, text=True, check=True, timeout=120
    )
    assert ran.stdout.strip() == env.step(np.full((3, 1), -0.5, np.float32))[0].tobytes().hex()


# actions


@pytest.mark.parametrize("name", IDS)
def test_actions_of_another_shape_are_refused_in_one_line(name, tmp_path):
    given = {"experiment": small(tmp_path)} if name == "JackBench-v0" else {}
    alone = gymnasium.make(name, disable_env_checker=True, **given)
    lanes = gymnasium.make_vec(name, 2, vectorization_mode="vector_entry_point", **given)
    for env in (alone, lanes):
        env.reset(seed=0)
        shape = env.action_space.shape
        for wrong in ((), (shape[-1] + 1,), (*shape, 1), (0,)):
            with pytest.raises(InputError, match=re.escape(f"an action of shape {wrong}; it must be {shape}")):
                env.step(np.zeros(wrong))
        with pytest.raises(InputError, match="no array of numbers"):
            env.step([[0.0], [0.0, 1.0]])
        env.step(np.zeros(shape))
