"""Tasks: their references, and how a task file is read."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from made_tasks import hold_at, mm, table_of

from envs.core import Core
from envs.references import FAMILIES, Multisine, Ramps, Range, Sines, Steps
from envs.single import JackPosition
from envs.task import load_task
from workbench.base.errors import InputError
from workbench.rigs.rig_file import load_rig, save_rig

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
    table = table_of("position")["references"]
    table["sines"]["weight"], table["ramps"]["weight"] = 0, 0
    core = Core(load_task(written("position", references=table), "position"), 1)
    drawn = {core._sampler.family(np.random.default_rng(seed)).__class__ for seed in range(60)}
    assert drawn == {Steps, Multisine}


# task files


def broken(written, name="position", **changes):
    with pytest.raises(InputError) as complaint:
        load_task(written(name, **changes), name)
    assert "\n" not in str(complaint.value)
    return str(complaint.value)


def test_unknown_keys_name_their_nearest(written):
    assert 'episod: unknown key; did you mean "episode"?' in broken(written, episod=1)
    assert 'references.stepz: unknown key; did you mean "steps"?' in broken(written, references={"stepz": {}})
    assert "reward.trak: unknown key" in broken(written, reward={"trak": 1})
    assert 'observation.observes = "ideals": did you mean "ideal"?' in broken(
        written, observation={"observes": "ideals"}
    )
    with pytest.raises(InputError, match=r'no bundled task "positon"; did you mean "position"'):
        load_task("positon", "position")


def test_wrong_values_are_refused_with_their_place(written):
    assert "start: low must not be above high" in broken(written, start=mm(2, 1))
    assert "start = [1, 2]: must be a table; write {low" in broken(written, start=[1, 2])
    assert "episode.unit: unit" in broken(written, episode={"value": 1, "unit": "mm"})
    assert "episode: shorter than one step" in broken(written, episode={"value": 0.1, "unit": "ms"})
    assert "episode: must be positive" in broken(written, episode={"value": 0, "unit": "s"})
    assert "control_periods = 0: must be a whole number" in broken(written, control_periods=0)
    assert "randomise = 1: must be true or false" in broken(written, randomise=1)
    assert "title: missing" in broken(written, title=None)
    assert "reward.effort.per: missing" in broken(written, reward={"effort": {"weight": 1}})
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
    env = JackPosition(written("position", observation={"observes": "sensors"}, **changes))
    observation, _ = env.reset(seed=0)
    assert [c.name for c in env.core.channels] == ["reference", "error", "command", "pa", "pb", "position"]
    assert abs(observation[0]) <= 90 / 97
    assert observation[5] == pytest.approx(observation[0] - observation[1] * 10 / 97, abs=1e-5)
    env = JackPosition(written("position", **changes))  # without noise, which is more than its guard bears
    env.reset(seed=0)
    for _ in range(20):
        observation, _, terminated, _, _ = env.step(np.array([0.02]))
        assert not terminated
    assert env.core.loops.x[0, env.core.plant.state("v")] > 0
