"""The compiled closed loop does what the loop in Python does: the same run, trips in the same sample."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from workbench.base.errors import InputError
from workbench.commands.run.options import load_config
from workbench.control.law import static_law
from workbench.engine import Engine
from workbench.engine.guard_shape import length
from workbench.linear import equilibrium
from workbench.loop.compiled_loop import compiled_law
from workbench.loop.rig_variations import variation, with_delay
from workbench.loop.sampled_loop import SIMULATION_FAILED, SampledLoop
from workbench.loop.sensors import Sensors
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
TUNED = load_config(EXPERIMENTS / "position_tuned.toml").controllers
FORCE = (
    *load_config(EXPERIMENTS / "force_tuned.toml").controllers,
    *load_config(EXPERIMENTS / "force_step.toml").controllers,
)
OTHERS = tuple(
    spec
    for name in ("position_mpc", "position_mode", "position_policy", "position_known")
    for spec in load_config(EXPERIMENTS / f"{name}.toml").controllers
)
SHIPPED = {f"{spec.name}{' in force' if spec in FORCE else ''}": spec for spec in (*TUNED, *FORCE, *OTHERS)}
SPECIMEN = {"ks": 1e7, "cs": 1e4}


def both(rig, spec, reference, seed=None, inputs=None, added=None):
    """The run in Python and the compiled one."""
    engine = Engine(build(rig))
    rest = equilibrium(engine.plant)
    controller = spec.build(rig.period.value)
    level = engine.observe(rest.x, rest.u)[engine.plant.output(controller.measures[0])]
    runs = []
    for compiled in (False, True):
        loop = SampledLoop(engine, rig, spec.build(rig.period.value), rest, seed, compiled=compiled)
        commands = [None, None] if added is None else np.split(added, 2)
        parts = zip(np.split(level + reference, 2), commands, strict=True)  # in two parts: it goes on
        runs.append([loop.run(part, inputs, command) for part, command in parts])
    return runs


def agree(python, compiled, size):
    for before, after in zip(python, compiled, strict=True):
        assert before.tripped == after.tripped
        assert np.allclose(before.demanded, after.demanded, rtol=1e-6, atol=1e-9)
        for name in ("position", "force", "command"):
            was, now = before.record.signals[name], after.record.signals[name]
            assert np.abs(was - now).max() <= 1e-6 * (size if name == "position" else np.abs(was).max() + 1e-3)


def rig_for(spec, name="nominal", delay=0.0):
    rig = variation(load_rig("jack-10t"), name)
    rig = rig.with_values(**SPECIMEN) if spec.stiffness else rig
    return with_delay(rig, delay) if delay else rig


@pytest.mark.parametrize("spec", SHIPPED.values(), ids=SHIPPED)
def test_every_shipped_law_runs_compiled_as_in_python(spec):
    size = 0.002 if spec.stiffness else 0.01
    step = size * (1e7 if spec.stiffness else 1.0)
    agree(*both(rig_for(spec), spec, np.full(300, step)), size)


@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    which=st.sampled_from(range(len(TUNED))),
    name=st.sampled_from(["nominal", "mass-50", "beta-50", "supply-20"]),
    delay=st.sampled_from([0.0, 0.3e-3, 1e-3, 1.4e-3]),
    seed=st.one_of(st.none(), st.integers(0, 99)),
    corners=st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=6),
)
def test_drawn_rigs_delays_noise_and_references_agree(which, name, delay, seed, corners):
    spec = TUNED[which]
    reference = np.repeat(corners, 200 // len(corners))
    reference = np.append(reference, np.full(200 - len(reference), corners[-1]))
    agree(*both(rig_for(spec, name, delay), spec, reference, seed), 0.05)


@pytest.mark.parametrize("name", ["p", "pid-lead", "crone1"])  # without memory; of the error; with an anti-windup
def test_a_command_that_is_added_to_the_laws_acts_in_both_alike(name):
    spec, t = next(one for one in TUNED if one.name == name), np.arange(400) * 1e-3
    added = np.where(t > 0.2, 2.0, 0.1) * np.sin(2 * np.pi * 5 * t)  # the guard limits the second half
    agree(*both(rig_for(spec, delay=0.3e-3), spec, 0.02 * np.sin(20 * t), 3, added=added), 0.02)


@pytest.mark.parametrize(("reference", "reason"), [(0.26, "too fast to stop"), (0.12, "force above"), (None, None)])
def test_trips_come_in_the_same_sample_with_the_same_words(reference, reason):
    spec = next(one for one in TUNED if one.name == "p-dp")
    rig = load_rig("jack-10t")
    rig = rig.with_values(ks=1e6, cs=0.0) if reason == "force above" else rig
    python, compiled = both(rig, spec, np.full(600, reference if reference else 0.01))
    assert (python[-1].tripped or "").startswith(reason or "")
    agree(python, compiled, 0.4)


def test_a_specimen_that_moves_is_the_same_input_to_both():
    spec = next(one for one in FORCE if one.name == "p-dp")
    t = np.arange(100) * 1e-3
    inputs = {"specimen_position": 0.1 * t, "specimen_velocity": np.full(100, 0.1)}
    agree(*both(rig_for(spec), spec, np.full(200, 1e4), None, inputs), 0.01)


def test_a_loop_that_cannot_be_simulated_ends_where_the_python_one_ends():
    spec = next(one for one in TUNED if one.name == "p")
    rig = load_rig("jack-10t")
    plant = build(rig)
    engine, rest = Engine(plant), equilibrium(plant)
    blow = {"disturbance": np.where(np.arange(50) == 20, 1e300, 0.0)}
    runs = [
        SampledLoop(engine, rig, spec.build(1e-3), rest, compiled=compiled).run(np.full(50, 0.01), blow)
        for compiled in (False, True)
    ]
    assert runs[0].tripped == runs[1].tripped == SIMULATION_FAILED
    assert len(runs[0].record.t) == len(runs[1].record.t) < 50


def test_a_rig_that_takes_absurdly_many_steps_is_refused_in_one_line(rig, monkeypatch):
    monkeypatch.setattr("workbench.engine.engine.RATE", 100.0)
    monkeypatch.setattr("workbench.engine.engine.BURST", 50.0)
    engine = Engine(build(rig))
    rest = equilibrium(engine.plant)
    loop = SampledLoop(engine, rig, TUNED[0].build(rig.period.value), rest, 1)
    with pytest.raises(InputError, match="jack-10t: a simulated second takes more than 100 steps of integration"):
        loop.run(np.zeros(200), added=0.5 * np.random.default_rng(0).uniform(-1, 1, 200))


@pytest.mark.parametrize("lanes", [1, 3])
@pytest.mark.parametrize("delay", [0.0, 2.5e-3])
def test_steps_in_fixed_places_are_one_run_to_the_bit_and_a_lane_that_fails_stays(lanes, delay):
    """A run of 12 instants, and four calls of three; then the first lane's plant cannot be simulated."""
    rig = with_delay(load_rig("jack-10t"), delay)
    engine, period, calls = Engine(build(rig)), rig.period.value, 4
    rest, sensors = equilibrium(engine.plant), Sensors(rig, engine.plant.outputs, None)
    law = static_law([5.0, -5.0], ("position",), period)
    ready = compiled_law(engine, rig, [law], sensors, engine.plant.p[None], ("force",))
    start, numbers = (
        ready.start(np.zeros((lanes, 0)), np.tile(rest.u[:1], (lanes, 1))),
        ready.numbers([law], np.zeros(1)),
    )
    rows = np.zeros((lanes, 3 * calls, length(ready.shape.inputs(engine.plant))))
    rows[:, :, 0] = 0.02 * np.random.default_rng(0).standard_normal((lanes, 3 * calls))
    x, state = np.tile(rest.x, (lanes, 1)), start.copy()
    batch, out = engine.run_sampled(ready.shape, x, ready.durations, state, rows, numbers)
    steps = engine.sampled_steps(ready.shape, ready.durations, start.copy(), np.zeros_like(rows[:, :3]), numbers)
    steps.x[:], steps.u[:], steps.p[:] = rest.x, rest.u, engine.plant.p
    for k in range(calls):
        steps.rows[:] = rows[:, 3 * k : 3 * k + 3]
        assert not steps.advance().any()
        np.testing.assert_array_equal(steps.out, out[:, 3 * k : 3 * k + 3])
        np.testing.assert_array_equal(steps.x, batch.x[:, 3 * k + 3])
    np.testing.assert_array_equal(steps.law, state)
    np.testing.assert_array_equal(steps.observe(), engine.outputs(steps.x, steps.u))
    steps.p[0, engine.plant.parameters.index("beta")] = np.nan
    assert steps.advance().tolist() == [True] + [False] * (lanes - 1)
    np.testing.assert_array_equal(steps.x[0], batch.x[0, -1])
    assert np.isfinite(steps.x).all()
