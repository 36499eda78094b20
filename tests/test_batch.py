"""Loops in lanes are the loops one by one; their operating points and metrics too."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.commands.run.config import load_config
from workbench.control.protocol import sampled_law
from workbench.engine import Engine
from workbench.linear import Equilibrium, equilibrium
from workbench.linear.equilibria import equilibria
from workbench.loop import step_metrics
from workbench.loop.batch import run_lanes
from workbench.loop.lane_metrics import step_lanes
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.rig import load_rig

TUNED = {c.name: c for c in load_config(Path(__file__).parents[1] / "experiments" / "position_tuned.toml").controllers}
LANES, INSTANTS, STEP = 9, 400, 0.01


@pytest.fixture(scope="module")
def rig():
    return with_delay(load_rig("jack-10t"), 0.3e-3)


@pytest.fixture(scope="module")
def plant(rig):
    return build(rig)


@pytest.fixture(scope="module")
def drawn(plant):
    """Parameters [lanes, k] and places in the stroke [lanes] m."""
    random, p = np.random.default_rng(0), np.tile(plant.p, (LANES, 1))
    for name, low, high in (("M", 0.5, 1.5), ("beta", 0.5, 1.15), ("Ps", 0.8, 1.03)):
        p[:, plant.parameters.index(name)] *= random.uniform(low, high, LANES)
    return p, random.uniform(-0.2, 0.2, LANES)


@pytest.mark.parametrize("speed", [0.0, 0.1])
def test_operating_points_in_lanes_are_those_one_by_one(plant, drawn, speed):
    p, places = drawn
    points = equilibria(plant, p, places, speed)
    assert points.ok.all()
    for lane in range(LANES):
        alone = equilibrium(plant, speed=speed, position=places[lane], p=p[lane])
        assert points.x[lane] / plant.scale == pytest.approx(alone.x / plant.scale, abs=1e-7)
        assert points.u[lane, 0] == pytest.approx(alone.u[0], abs=1e-8)


@pytest.mark.parametrize("command", [0.0, 0.3])
def test_moving_points_in_lanes_have_the_speed_that_a_command_gives(plant, drawn, command):
    p, places = drawn
    points = equilibria(plant, p, places, command=command)
    assert points.ok.all()
    for lane in range(3):
        alone = equilibrium(plant, command=command, position=places[lane], p=p[lane])
        assert points.x[lane] / plant.scale == pytest.approx(alone.x / plant.scale, abs=1e-7)
        assert points.u[lane] == pytest.approx(alone.u)


@pytest.mark.parametrize("name", ["p", "p-dp", "crone3"])
@pytest.mark.parametrize("seed", [None, 4])
def test_a_lane_is_the_loop_by_itself(rig, plant, drawn, name, seed):
    p, places = drawn
    points, law = equilibria(plant, p, places), sampled_law(TUNED[name].build(1e-3))
    runs = run_lanes(Engine(plant), rig, law, points, p, np.full(INSTANTS, STEP), ("position",), seed)
    positions = np.concatenate([lanes.signals["position"] for _, lanes in runs])
    for lane in (0, LANES - 1) if seed is None else (0,):  # the seed of lane 0 is a loop's own
        start = Equilibrium(points.x[lane], points.u[lane], 0.0)
        loop = SampledLoop(Engine(replace(plant, p=p[lane])), rig, TUNED[name].build(1e-3), start, seed, compiled=False)
        alone = loop.run(np.full(INSTANTS, places[lane] + STEP)).record.signals["position"]
        assert np.abs(positions[lane] - alone).max() < 1e-6 * STEP


def test_designs_run_in_lanes_as_they_do_one_by_one(rig, plant, drawn):
    p, places = drawn
    spec, points = TUNED["p-dp"], equilibria(plant, p, places)
    designs = [replace(spec, design=replace(spec.design, gain=gain)) for gain in np.linspace(1, 4, LANES)]
    laws, inputs = [sampled_law(each.build(1e-3)) for each in designs], {"disturbance": np.full(INSTANTS, 5e3)}
    reference = np.full(INSTANTS, STEP)
    ((_, lanes),) = run_lanes(Engine(plant), rig, laws, points, p, reference, ("position",), inputs=inputs)
    for lane in (0, 4, LANES - 1):
        start = Equilibrium(points.x[lane], points.u[lane], 0.0)
        loop = SampledLoop(Engine(replace(plant, p=p[lane])), rig, designs[lane].build(1e-3), start, compiled=False)
        alone = loop.run(places[lane] + reference, inputs).record.signals["position"]
        assert np.abs(lanes.signals["position"][lane] - alone).max() < 1e-6 * STEP


def test_laws_of_different_forms_are_no_lanes(rig, plant, drawn):
    p, places = drawn
    laws = [sampled_law(TUNED[name].build(1e-3)) for name in ("p", "p-dp")]
    with pytest.raises(ValueError, match="same signals"):
        next(run_lanes(Engine(plant), rig, laws, equilibria(plant, p, places), p, np.zeros(9), ("position",)))


def test_a_lane_that_trips_leaves_the_others_alone(rig, plant, drawn):
    p, places = drawn
    places = np.where(np.arange(LANES) == 3, 0.235, places)
    points, law = equilibria(plant, p, places), sampled_law(TUNED["p-dp"].build(1e-3))
    ((_, lanes),) = run_lanes(Engine(plant), rig, law, points, p, np.full(INSTANTS, STEP), ("position",))
    assert lanes.why(3) == "stroke"
    assert not np.delete(lanes.trip, 3).any()
    assert not lanes.failed.any()


def test_metrics_in_lanes_are_those_one_by_one():
    random, t = np.random.default_rng(1), np.arange(1000) * 1e-3
    rate, swing = random.uniform(5, 60, 20), random.uniform(0, 0.5, 20)
    y = 0.02 + STEP * (1 - np.exp(-rate[:, None] * t) * (1 + swing[:, None] * np.sin(60 * t)))
    lanes = step_lanes(1e-3, y, np.full(20, 0.02), STEP, 0.02 * STEP)
    for row, settling, overshoot, oscillation in zip(
        y, lanes.settling, lanes.overshoot, lanes.oscillation, strict=True
    ):
        alone = step_metrics.settling_time(t, row, 0.02 + STEP, 0.02 * STEP)
        assert np.isnan(settling) if alone is None else settling == pytest.approx(alone)
        assert overshoot == pytest.approx(step_metrics.overshoot(row, 0.02, 0.02 + STEP), abs=1e-9)
        expected = step_metrics.residual_oscillation(t, row, STEP)
        assert oscillation == pytest.approx(expected, rel=1e-6, abs=1e-12)
