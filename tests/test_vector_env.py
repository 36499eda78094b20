"""The vector environment: lane by lane the single one, bit for bit, with Gymnasium's autoreset."""

import copy
import tomllib
from importlib.resources import files

import gymnasium
import numpy as np
import pytest
import tomli_w
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from envs.single import JackForce, JackPosition
from envs.vector import JackForceVector, JackPositionVector
from workbench.base.errors import InputError

KINDS = {
    "position": (JackPosition, JackPositionVector),
    "position-sensors": (JackPosition, JackPositionVector),
    "force-moving-end": (JackForce, JackForceVector),
}


def short(tmp_path, name="position", **changes):
    """A bundled task, its episode 30 ms long unless changed."""
    table = tomllib.loads((files("envs") / "tasks" / f"{name}.toml").read_text())
    table |= {"episode": {"value": 30, "unit": "ms"}, **changes}
    path = tmp_path / f"{name}.toml"
    path.write_text(tomli_w.dumps(table))
    return path


def actions_of(lanes, steps, seed=0):
    """Smooth and rough commands, some beyond the limits."""
    random = np.random.default_rng(seed)
    t = np.arange(steps)[:, None, None]
    return (np.sin(t / random.uniform(3, 30, (1, lanes, 1))) + 0.3 * random.standard_normal((steps, lanes, 1))).astype(
        "f4"
    )


def same_infos(infos, wanted):
    """Arrays by name, in tables within tables; `final_obs` is of arrays, or None."""
    assert infos.keys() == wanted.keys()
    for key, value in infos.items():
        if isinstance(value, dict):
            same_infos(value, wanted[key])
        elif key == "final_obs":
            for ours, theirs in zip(value, wanted[key], strict=True):
                np.testing.assert_array_equal(ours, theirs)
        else:
            np.testing.assert_array_equal(value, wanted[key])


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("task", KINDS)
@pytest.mark.parametrize("lanes", [1, 3])
def test_lanes_are_the_single_environment_bit_for_bit(tmp_path, task, lanes, mode):
    single, vector = KINDS[task]
    path, steps = short(tmp_path, task), 200
    seeds: list[int | None] = [*(11, 5, 8)[:lanes]]
    together = vector(lanes, path, mode)
    alone = SyncVectorEnv([lambda: single(path)] * lanes, autoreset_mode=mode)  # Gymnasium's own way to autoreset
    for (got, infos), (wanted, wanted_infos) in [(together.reset(seed=seeds), alone.reset(seed=seeds))]:
        np.testing.assert_array_equal(got, wanted)
        np.testing.assert_array_equal(infos["error"], wanted_infos["error"])
    ends = 0
    for actions in actions_of(lanes, steps):
        got, wanted = together.step(actions), alone.step(actions)
        for ours, theirs in zip(got[:4], wanted[:4], strict=True):
            assert ours.dtype == theirs.dtype
            np.testing.assert_array_equal(ours, theirs)
        same_infos(got[4], wanted[4])
        ends += int((got[2] | got[3]).sum())
    assert ends >= 6 * lanes


def test_made_by_gymnasium_over_lanes(tmp_path):
    path = str(short(tmp_path))
    made = gymnasium.make_vec("JackPosition-v0", num_envs=3, vectorization_mode="vector_entry_point", task=path)
    assert isinstance(made.unwrapped, JackPositionVector)
    assert isinstance(gymnasium.make_vec("JackForce-v0", num_envs=2).unwrapped, JackForceVector)
    assert made.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert made.single_observation_space == gymnasium.make("JackPosition-v0", task=path).observation_space
    observations, _ = made.reset(seed=0)
    assert observations in made.observation_space
    observations, rewards, *_ = made.step(made.action_space.sample())
    assert observations in made.observation_space
    assert rewards.shape == (3,)


def test_seed_is_counted_up_over_lanes_and_goes_on_without_one(tmp_path):
    path = short(tmp_path)
    vector, actions = JackPositionVector(3, path), actions_of(3, 70)
    first = [vector.reset(seed=4)[0], *(vector.step(a)[0] for a in actions), vector.reset()[0]]
    again = [vector.reset(seed=[4, 5, 6])[0], *(vector.step(a)[0] for a in actions), vector.reset(seed=[None] * 3)[0]]
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[0], first[-1])
    assert not np.array_equal(first[0][0], first[0][1])


def test_autoreset_takes_the_step_after_the_end(tmp_path):
    path = short(tmp_path, episode={"value": 5, "unit": "ms"})
    vector, idle = JackPositionVector(2, path), np.zeros((2, 1), np.float32)
    first, _ = vector.reset(seed=0)
    last = first
    for k in range(1, 6):
        last, rewards, terminated, truncated, _ = vector.step(idle)
        assert not terminated.any()
        assert truncated.tolist() == [k == 5] * 2
    begun, rewards, terminated, truncated, infos = vector.step(np.full((2, 1), np.nan, np.float32))  # ignored
    assert not terminated.any()
    assert not truncated.any()
    assert rewards.tolist() == [0, 0]
    assert infos["command"] == pytest.approx(0, abs=1e-12)
    assert not np.array_equal(begun, last)
    assert not np.array_equal(begun, first)
    assert [vector.step(idle)[3].any() for _ in range(5)] == [False] * 4 + [True]


@pytest.mark.parametrize("task", KINDS)
def test_without_autoreset_lanes_wait_for_their_own_reset_as_gymnasium_has_them(tmp_path, task):
    path, (one, many) = short(tmp_path, task), KINDS[task]
    ours = many(3, path, AutoresetMode.DISABLED)
    theirs = SyncVectorEnv([lambda: one(path)] * 3, autoreset_mode=AutoresetMode.DISABLED)
    resets = [{"seed": 4}]
    for actions in actions_of(3, 80):
        for given in resets:
            got, wanted = ours.reset(**copy.deepcopy(given)), theirs.reset(**copy.deepcopy(given))
            np.testing.assert_array_equal(got[0], wanted[0])
            same_infos(got[1], wanted[1])
        got, wanted = ours.step(actions), theirs.step(actions)
        for mine, other in zip(got[:4], wanted[:4], strict=True):
            np.testing.assert_array_equal(mine, other)
        ended = got[2] | got[3]
        resets = [{"options": {"reset_mask": np.arange(3) == lane}} for lane in np.flatnonzero(ended)]
        if ended.any():
            with pytest.raises(gymnasium.error.ResetNeeded, match="the episode of lane"):
                ours.step(actions)


def test_a_lane_that_trips_says_why_and_leaves_its_neighbours_alone(tmp_path):
    path = short(tmp_path)
    calm, vector = JackPositionVector(2, path), JackPositionVector(2, path)
    calm.reset(seed=0)
    vector.reset(seed=0)
    idle = np.zeros((2, 1), np.float32)
    for k in range(40):
        quiet, other = calm.step(idle), vector.step(np.array([[0.0], [np.nan if k == 3 else 0.0]], np.float32))
        for ours, theirs in zip(other[:4], quiet[:4], strict=True):
            np.testing.assert_array_equal(ours[0], theirs[0])
        assert other[2].tolist() == [False, k == 3]
        if k == 3:
            assert other[4]["trip"].tolist() == [None, "the controller's command is not finite"]
            assert other[4]["_trip"].tolist() == [False, True]
        else:
            assert "trip" not in other[4]


def test_a_lane_whose_simulation_fails_ends_alone_and_begins_anew(tmp_path):
    path = short(tmp_path, control_periods=2)
    calm, vector = JackPositionVector(3, path), JackPositionVector(3, path)
    actions = np.array([[0.0], [1.0], [0.0]], np.float32)
    for each in (calm, vector):
        each.reset(seed=0)
    vector.core.loops.p[1, vector.core.plant.parameters.index("beta")] = np.nan
    for ended in (True, False, False):
        quiet, other = calm.step(actions), vector.step(actions)
        assert other[2].tolist() == [False, ended, False]
        for ours, theirs in zip(other[:4], quiet[:4], strict=True):
            np.testing.assert_array_equal(ours[[0, 2]], theirs[[0, 2]])
        assert all(np.isfinite(part).all() for part in other[:2])


def test_lanes_have_their_own_numbers_and_references(tmp_path):
    vector = JackPositionVector(4, short(tmp_path))
    vector.reset(seed=0)
    varied = np.ptp(vector.core.loops.p, axis=0) > 0
    assert varied.sum() == sum(n.low is not None for n in vector.core.task.rig.numbers.values())
    assert len(np.unique(vector.core.loops.x[:, vector.core.plant.state("x")])) == 4


def test_what_was_returned_belongs_to_the_caller(tmp_path):
    path = short(tmp_path)
    kept, spoiled = JackPositionVector(2, path), JackPositionVector(2, path)
    kept.reset(seed=0)
    spoiled.reset(seed=0)
    before = []
    for actions in actions_of(2, 70):
        pair = [vector.step(actions) for vector in (kept, spoiled)]
        ours, theirs = ((*returned[:4], *returned[4].values()) for returned in pair)
        for mine, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(mine, other)
            before.append((mine, mine.copy()))
            other[...] = 1
    for array, same in before:
        np.testing.assert_array_equal(array, same)


def test_bad_calls_are_refused(tmp_path):
    path = short(tmp_path)
    with pytest.raises(InputError, match="num_envs = 0"):
        JackPositionVector(0, path)
    with pytest.raises(InputError, match="autoreset_mode = 'Never': must be 'NextStep' or 'SameStep' or 'Disabled'"):
        JackPositionVector(2, path, "Never")
    vector = JackPositionVector(2, path)
    with pytest.raises(gymnasium.error.ResetNeeded):
        vector.step(np.zeros((2, 1)))
    with pytest.raises(InputError, match="3 seeds for 2 lanes"):
        vector.reset(seed=[1, 2, 3])
    with pytest.raises(InputError, match="unknown option"):
        vector.reset(options={"mask": 1})
    for mask in (np.ones(3, bool), np.zeros(2, bool), np.ones(2)):
        with pytest.raises(InputError, match="reset_mask must be 2 times True or False"):
            vector.reset(options={"reset_mask": mask})
    with pytest.raises(InputError, match="no episode yet"):
        JackPositionVector(2, path).reset(options={"reset_mask": np.array([True, False])})
