"""Environments of a rig whose commands arrive late: each lane by its own delay, alone as among others."""

from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from gymnasium.vector import SyncVectorEnv
from made_tasks import table_of

from envs.single import JackPosition
from envs.vector import JackPositionVector
from workbench.engine import Engine
from workbench.plant import build
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, save_rig

STEPS = 60


@pytest.fixture
def task(tmp_path):
    """The position task on the 10 t rig, late by so many ms (None: prompt), drawn within bounds [ms] if given."""

    def write(milliseconds, low=None, high=None, **changes):
        late = EffectUse("drive.delay", "", {"delay": Number("delay", milliseconds, "ms", "ms", "", low, high)})
        rig = replace(load_rig("jack-10t"), effects=() if milliseconds is None else (late,))
        save_rig(rig, tmp_path / "late.toml")
        table = table_of("position") | {"rig": "late.toml", "episode": {"value": STEPS, "unit": "ms"}, **changes}
        (tmp_path / "late-task.toml").write_text(tomli_w.dumps(table))
        return tmp_path / "late-task.toml"

    return write


def actions(lanes):
    return 0.3 * np.random.default_rng(2).standard_normal((STEPS, lanes, 1)).astype("f4")


@pytest.mark.parametrize("milliseconds", [3, 1.7])
def test_a_jack_gets_its_commands_late(task, milliseconds):
    """The realised commands, moved by the delay on a grid of tenths of a period, move the jack as it was moved."""
    still = {"start": {"low": 0, "high": 0, "unit": "mm"}, "randomise": False}
    env, engine, fine = JackPosition(task(milliseconds, **still)), Engine(build(load_rig("jack-10t")), 1e-8), 10
    env.reset(seed=0)
    x, held = env.core.loops.x[0].copy(), env.core.loops.u[0].copy()
    commands, reached = [], []
    for action in actions(1)[:, 0]:
        commands.append(env.step(action)[-1]["command"])
        reached.append(env.core.loops.x[0].copy())
    u = np.tile(held, (STEPS * fine, 1))
    shift = round(milliseconds * fine)
    u[shift:, 0] = np.repeat(commands, fine)[: len(u) - shift]
    expected = engine.run(x, np.arange(len(u) + 1) * 1e-3 / fine, u).x[fine::fine]
    assert np.all(np.abs(np.array(reached) - expected) < 1e-3 * engine.plant.scale)
    assert np.ptp(expected, axis=0)[engine.plant.state("z3")] > 0.05 * engine.plant.scale[engine.plant.state("z3")]


def test_lanes_of_different_delays_are_the_single_environment_bit_for_bit(task):
    path, lanes = task(1.5, 0.0, 6.0, control_periods=2), 4
    together, alone = JackPositionVector(lanes, path), SyncVectorEnv([lambda: JackPosition(path)] * lanes)
    for ours, theirs in zip(together.reset(seed=3)[:1], alone.reset(seed=3)[:1], strict=True):
        np.testing.assert_array_equal(ours, theirs)
    delays = [together.core.plant.lateness(p) for p in together.core.loops.p]
    assert len(set(delays)) == lanes
    ends = 0
    for action in np.concatenate((actions(lanes), actions(lanes))):
        got, wanted = together.step(action), alone.step(action)
        for ours, theirs in zip(got[:4], wanted[:4], strict=True):
            np.testing.assert_array_equal(ours, theirs)
        ends += np.count_nonzero(got[2] | got[3])
    assert ends > lanes  # what was on its way at an end is forgotten by the next episode


def test_no_delay_changes_nothing_to_the_bit(task):
    one, other = (JackPosition(task(milliseconds, randomise=False)) for milliseconds in (0.0, None))
    np.testing.assert_array_equal(one.reset(seed=4)[0], other.reset(seed=4)[0])
    for action in actions(1)[:, 0]:
        for ours, theirs in zip(one.step(action)[:4], other.step(action)[:4], strict=True):
            np.testing.assert_array_equal(ours, theirs)
