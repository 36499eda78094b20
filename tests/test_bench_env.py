"""JackBench: a policy in it does what its exported file does under a bench, and is charged what a bench counts."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from test_vector_env import same_infos

from envs.bench.baselines import controller_episodes, policy_episodes
from envs.bench.core import TRIP, BenchCore, silent_policy
from envs.bench.environments import JackBench, JackBenchVector
from envs.bench.export import save_policy, trained_policy
from envs.bench.task import load_bench_task
from workbench.base.errors import InputError
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.train.options import load_train
from workbench.control.law import LawController
from workbench.control.network_law import network_shell
from workbench.control.shell import around
from workbench.loop.batch import run_lanes
from workbench.loop.sensors import settling_band
from workbench.loop.step_metrics import overshoot, settling_time
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, save_rig

TRAIN = (Path(__file__).parents[1] / "experiments" / "train_p_dp.toml").read_text()


def small(folder, ideal=False, **changes):
    """The shipped experiment on its nominal rig alone, at two places in the stroke, 0.6 s."""
    head, _, law = TRAIN.partition("# below what")
    head = head.partition("# plants are drawn")[0]
    head = re.sub(r"rigs = .*", 'rigs = ["nominal"]', head) + "positions = [-0.5, 0.5]\n"
    head += "ideal = true\n" * ideal
    whole = head + law.partition("\n")[2].replace("[goals]\n", "[goals]\nseconds = 0.6\n")
    for old, new in changes.items():
        whole = re.sub(rf"^{old} = .*", f"{old} = {new}", whole, flags=re.MULTILINE)
    path = folder / "small.toml"
    path.write_text(whole)
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return small(tmp_path_factory.mktemp("train"))


def some_policy(decision=0.005, past=2, seed=0):
    """With weights that move the jack, and leave it within its limits."""
    silent, random = silent_policy(0.01, 5e6, past, 0.02, decision), np.random.default_rng(seed)
    sizes = [1 + 2 * past, 6, 1]
    layers = [(random.normal(0, 0.2, (out, into)), np.zeros(out)) for into, out in pairwise(sizes)]
    return replace(silent, layers=tuple(layers))


def decided(policy, shown):
    """What a policy makes of what it is shown [lanes, k]: actions [lanes]."""
    for weights, biases in policy.layers[:-1]:
        shown = np.tanh(shown @ weights.T + biases)
    weights, biases = policy.layers[-1]
    return np.clip(shown @ weights.T + biases, -1, 1)[:, 0]


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_lanes_are_the_single_environment_bit_for_bit(path, mode):
    together = JackBenchVector(3, path, autoreset_mode=mode)
    alone = SyncVectorEnv([lambda: JackBench(path)] * 3, autoreset_mode=mode)
    random = np.random.default_rng(0)
    np.testing.assert_array_equal(together.reset(seed=2)[0], alone.reset(seed=2)[0])
    ends = 0
    for k in range(260):
        actions = random.normal(0, 0.2, (3, 1)).astype("f4")
        if 140 < k < 200:
            actions[0] = 1.0  # a trip
        got, wanted = together.step(actions), alone.step(actions)
        for ours, theirs in zip(got[:4], wanted[:4], strict=True):
            assert ours.dtype == theirs.dtype
            np.testing.assert_array_equal(ours, theirs)
        same_infos(got[4], wanted[4])
        ends += int((got[2] | got[3]).sum())
    assert ends >= 6


def late(folder, policy):
    """The task on plants whose commands are late, each by more than the one before."""
    effect = EffectUse("drive.delay", "", {"delay": Number("delay", 1.0, "ms", "ms", "", 0.5, 4.0)})
    save_rig(replace(load_rig("jack-10t"), effects=(effect,)), folder / "late.toml")
    task = load_bench_task(small(folder, ideal=True, rig='"late.toml"'), policy)
    p = task.plants.p.copy()
    p[:, task.plants.engine.plant.parameters.index("drive.delay.delay")] = 1e-3 * np.linspace(0.7, 2.2, len(p))
    return replace(task, plants=replace(task.plants, p=p))


@pytest.mark.parametrize(("decision", "is_late"), [(0.001, False), (0.005, False), (0.005, True)])
def test_a_policy_in_it_does_what_its_law_does_under_a_bench(tmp_path, decision, is_late):
    policy = some_policy(decision)
    task = late(tmp_path, policy) if is_late else load_bench_task(small(tmp_path, ideal=True), policy)
    core, plants = BenchCore(task, 4), task.plants
    shown = core.reset([np.random.default_rng(i) for i in range(4)]).observation
    assert len(set(zip(core.plant, core.scenario, strict=True))) > 2
    positions = [core.position.copy()]
    for _ in range(task.steps):
        shown = core.step(decided(policy, shown)).observation  # in float32, the law in float64
        positions.append(core.position.copy())
    t, law = np.arange(task.steps * task.periods + 1) * 1e-3, around(task.law, network_shell(policy, 1e-3))
    for lane, (plant, scenario) in enumerate(zip(core.plant, core.scenario, strict=True)):
        on, course = plants.some([plant]), task.scenarios[scenario]
        asked = course.reference(t) * (-1 if on.position[0] > 0 else 1)
        runs = run_lanes(on.engine, on.rig, law, on.null, on.p, asked, ("position",), None, course.inputs(t))
        ((_, run),) = runs
        alone = run.signals["position"][0, :: task.periods]
        np.testing.assert_allclose(np.array(positions)[:, lane], alone, atol=1e-7)
        assert np.ptp(alone) > 1e-4


def test_it_charges_what_a_bench_counts(path):
    env = JackBenchVector(8, path, decision=0.001)
    _, infos = env.reset(seed=5)
    core, task = env.core, env.core.task
    positions, commands, total, truncated = [core.position.copy()], [infos["command"]], np.zeros(8), np.zeros(8, bool)
    for _ in range(task.steps):
        _, rewards, _, truncated, infos = env.step(np.zeros((8, 1)))
        total += rewards
        positions.append(core.position.copy())
        commands.append(infos["command"])
    assert truncated.all()
    t, travel = np.arange(task.steps + 1) * 1e-3, np.abs(np.diff(commands, axis=0)).sum(axis=0)
    weights = task.weights
    for lane, y in enumerate(np.array(positions).T):
        scenario = task.scenarios[core.scenario[lane]]
        target = y[0] + scenario.size * (-1 if task.plants.position[core.plant[lane]] > 0 else 1)
        band = settling_band(task.plants.rig, "position", scenario.size)
        error = np.abs(y - target)[1:][t[1:] >= (scenario.arrives or 0.0) - 1e-9]
        cost = weights["iae"] * error.sum() * 1e-3 / (scenario.size or band) + weights["ms"] * travel[lane]
        if scenario.size:
            assert infos["settling"][lane] == settling_time(t, y, target, band)
            assert infos["overshoot"][lane] == pytest.approx(overshoot(y, y[0], target), abs=1e-9)
            cost += weights["overshoot_percent"] * infos["overshoot"][lane]
            cost += weights["settling_s"] * 1e-3 * np.sum(error > band)
            assert infos["is_success"][lane]
        assert total[lane] == pytest.approx(-cost, rel=1e-9)
    assert len(set(core.scenario)) == 2


def test_a_trip_costs_more_than_an_episode(path):
    env = JackBench(path, limit=1.0)
    env.reset(seed=0)
    total, terminated, info = 0.0, False, {}
    while not terminated:
        _, reward, terminated, truncated, info = env.step(np.ones(1))
        total += reward
        assert not truncated
    assert total < -TRIP
    assert info["trip"]
    assert not info["is_success"]


def test_its_docstring_says_the_weights_of_the_shipped_experiment():
    config, text = load_train(Path(__file__).parents[1] / "experiments" / "train_p_dp.toml"), JackBench.__doc__ or ""
    weights = {
        "settling_s": "{:g}/s time",
        "overshoot_percent": "{:g}/% over",
        "iae": "{:g}/s IAE",
        "ms": "{:g} travel",
    }
    for key, words in weights.items():
        assert words.format(config.weights[key]) in text
    assert f"`overshoot_percent` ({config.limits.overshoot_percent:g} %)" in text
    assert f"`seconds` ({config.limits.seconds:g} s)" in text
    assert f"{TRIP:g} if it trips" in text.replace("\n    ", " ")


def test_what_is_saved_runs_as_any_controller(path, tmp_path):
    policy = some_policy()
    task = load_bench_task(path, policy)
    (spec,) = load_steps(save_policy(policy, task, tmp_path / "mine")).controllers
    assert spec.compensators[-1].design.network == policy
    assert isinstance(spec.build(1e-3), LawController)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"scenarios": '["position-sine-5hz"]'}, "takes steps of position and loads"),
        ({"experiment": '"tune"'}, 'is not "train"'),
    ],
)
def test_other_experiments_are_refused(tmp_path, changes, says):
    with pytest.raises(InputError, match=says):
        JackBench(small(tmp_path, **changes))


def test_a_law_without_a_policy_is_paid_alike_inside_and_in_place_of_it(tmp_path):
    """Without noise; the environment draws its plants and scenarios."""
    env = JackBenchVector(40, small(tmp_path, ideal=True), autoreset_mode="SameStep")
    task = env.core.task
    config = task.source.start.controllers[0]
    law = replace(config, compensators=config.compensators[:-1])
    inside, outside = policy_episodes(env, lambda shown: np.zeros((40, 1))), controller_episodes(task, law, 2)
    assert not np.concatenate((inside.tripped, outside.tripped)).any()
    for numbers in ("returns", "settling", "overshoot"):
        mine, theirs = (np.unique(np.round(getattr(each, numbers), 5)) for each in (inside, outside))
        np.testing.assert_allclose(mine, theirs, rtol=1e-4)
    assert np.isnan(inside.settling).any()


def test_rigs_may_be_files(tmp_path):
    heavy = load_rig("jack-10t").with_values(M=1600.0)
    save_rig(heavy, tmp_path / "heavy.toml")
    task = load_bench_task(small(tmp_path, rigs='["nominal", "heavy.toml"]'), some_policy())
    masses = task.plants.p[:, task.plants.engine.plant.parameters.index("M")]
    assert sorted(masses) == [1000.0] * 2 + [1600.0] * 2


def test_stable_baselines_checker_is_content(path):
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="stable-baselines3 is not installed")
    checker.check_env(JackBench(path))


def test_decisions_must_be_whole_periods(path):
    with pytest.raises(InputError, match="a multiple of the period"):
        JackBench(path, decision=0.0015)


def test_made_by_gymnasium(path):
    env = gymnasium.make("envs:JackBench-v0", experiment=path, past=3)
    assert env.observation_space.shape == (7,)
    many = gymnasium.make_vec("envs:JackBench-v0", num_envs=2, experiment=path, autoreset_mode="SameStep")
    assert many.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def test_an_actor_of_stable_baselines_is_exported_as_it_decides(path, tmp_path):
    sb3 = pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed")
    from envs.stable_baselines import StableBaselinesLanes

    env = JackBenchVector(4, path, autoreset_mode="SameStep")
    shape = {"net_arch": [8, 8], "log_std_init": -2.0}
    model = sb3.PPO("MlpPolicy", StableBaselinesLanes(env), n_steps=60, batch_size=60, seed=0, policy_kwargs=shape)
    model.learn(480)
    policy = trained_policy(model, env.core.task.policy)
    shown = np.random.default_rng(0).normal(0, 1, (20, 9)).astype("f4")
    np.testing.assert_allclose(decided(policy, shown), model.predict(shown, deterministic=True)[0][:, 0], atol=1e-5)
    assert load_steps(save_policy(policy, env.core.task, tmp_path)).controllers
    model = sb3.PPO(
        "MlpPolicy", StableBaselinesLanes(env), policy_kwargs={"activation_fn": sb3.common.torch_layers.nn.ReLU}
    )
    with pytest.raises(InputError, match="has a ReLU"):
        trained_policy(model, env.core.task.policy)
