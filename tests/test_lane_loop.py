"""MPC in lanes is MPC one plant after another: the same commands, plans, trips and noise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controllers.lap_inverse import LapInverse
from controllers.mpc import Mpc
from controllers.shaping import Shaping
from workbench.commands.run.config import load_config
from workbench.control.compensators import Compensated, Mapped, OnLoadCell
from workbench.control.protocol import lane_controller
from workbench.engine import Engine
from workbench.linear import Equilibrium
from workbench.linear.equilibria import equilibria
from workbench.loop.lane_loop import play_lanes, plays_in_lanes
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.rig import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
SPECS = {spec.name: spec for spec in load_config(EXPERIMENTS / "position_mpc.toml").controllers}
JACK = ("velocity_gain", "jack_frequency", "jack_damping", "valve_frequency", "valve_damping", "delay")
LANES, INSTANTS, PERIOD = 6, 300, 1e-3


@pytest.fixture(scope="module")
def rig():
    return with_delay(load_rig("jack-10t"), 0.3e-3)


@pytest.fixture(scope="module")
def plant(rig):
    return build(rig)


@pytest.fixture(scope="module")
def drawn(plant):
    """Parameters [lanes, k] and operating points."""
    random, p = np.random.default_rng(2), np.tile(plant.p, (LANES, 1))
    for name, low, high in (("M", 0.5, 1.5), ("beta", 0.5, 1.15), ("Ps", 0.8, 1.03)):
        p[:, plant.parameters.index(name)] *= random.uniform(low, high, LANES)
    return p, equilibria(plant, p, np.linspace(-0.216, 0.12, LANES))


def both(rig, plant, drawn, name, step, seed=None, lanes=range(LANES), force=5e3):
    """What lanes did, and each of some by itself, along a step [m] from where they stand, and a step of force [N]."""
    (p, points), load = drawn, {"disturbance": np.where(np.arange(INSTANTS) < 150, 0.0, force)}
    reference = np.full(INSTANTS, step)
    measured = ("position", "pa")
    ((_, together),) = play_lanes(
        Engine(plant), rig, SPECS[name].build(PERIOD), points, p, reference, measured, seed, load
    )
    alone = {}
    for lane in lanes:
        start = Equilibrium(points.x[lane], points.u[lane], 0.0)
        loop = SampledLoop(Engine(replace(plant, p=p[lane])), rig, SPECS[name].build(PERIOD), start, seed)
        position = plant.observe(start.x, start.u, p[lane])[0, plant.output("position")]
        alone[lane] = loop.run(position + reference, load)
    return together, alone


def same(together, alone, step):
    for lane, run in alone.items():
        assert np.abs(together.signals["position"][lane] - run.record.signals["position"]).max() < 1e-9 * step
        assert np.abs(together.demanded[lane] - run.demanded).max() < 1e-9
        assert np.abs(together.sent[lane] - run.record.signals["command"]).max() < 1e-9


@pytest.mark.parametrize("name", ["mpc", "mpc-preview", "mpc-bare"])
@pytest.mark.parametrize("step", [0.01, 0.1])
def test_every_lane_is_the_loop_by_itself(rig, plant, drawn, name, step):
    together, alone = both(rig, plant, drawn, name, step)
    same(together, alone, step)
    assert not together.failed.any()
    assert not together.trip.any()


def test_limits_bind_in_a_step_of_100_mm(rig, plant, drawn):
    free = SPECS["mpc"].design
    free = replace(free, pressure=1e8, speed=100.0, command_rate=1e4)
    spec = replace(SPECS["mpc"], design=free)
    demanded = [
        next(play_lanes(Engine(plant), rig, each.build(PERIOD), drawn[1], drawn[0], np.full(100, 0.1), ()))[1].demanded
        for each in (SPECS["mpc"], spec)
    ]
    assert np.abs(demanded[1] - demanded[0]).max(axis=1).min() > 0.02


def test_the_noise_of_the_first_lane_is_that_of_a_loop(rig, plant, drawn):
    same(*both(rig, plant, drawn, "mpc", 0.1, seed=5, lanes=[0]), 0.1)


def test_a_lane_that_trips_goes_to_command_0_and_leaves_the_others_alone(rig, plant, drawn):
    p, _ = drawn
    far = p, equilibria(plant, p, np.where(np.arange(LANES) == 3, 0.2395, -0.1))
    together, alone = both(rig, plant, far, "mpc", 0.0, lanes=[1, 3], force=-6e4)
    assert together.why(3) == "stroke"
    assert alone[3].tripped.startswith("position beyond")
    assert not np.delete(together.trip, 3).any()
    assert together.sent[3, -1] == 0.0
    same(together, alone, 0.1)


def test_a_lane_that_cannot_be_simulated_has_no_signals_from_there_on(rig, plant, drawn):
    p, points = drawn
    broken = p.copy()
    broken[4, plant.parameters.index("Ps")] = np.nan
    ((_, lanes),) = play_lanes(
        Engine(plant), rig, SPECS["mpc"].build(PERIOD), points, broken, np.full(50, 0.01), ("position",)
    )
    ((_, sound),) = play_lanes(
        Engine(plant), rig, SPECS["mpc"].build(PERIOD), points, p, np.full(50, 0.01), ("position",)
    )
    others = np.arange(LANES) != 4
    assert lanes.failed.tolist() == (~others).tolist()
    assert np.isnan(lanes.sent[4, 1:]).all()
    assert lanes.signals["position"][others] == pytest.approx(sound.signals["position"][others])


def test_what_is_around_a_controller_is_in_lanes_as_well(rig, plant, drawn):
    p, points = drawn
    inner = SPECS["mpc"].build(PERIOD)

    def made():
        shaped = Compensated(SPECS["mpc"].build(PERIOD), Shaping(Shaping.Design(corner=20.0, lead=3e-3), PERIOD))
        return Mapped(shaped, LapInverse(LapInverse.Design(excess=2e-3, width=2e-3), PERIOD).command_map)

    reference = np.full(100, 0.01)
    ((_, lanes),) = play_lanes(Engine(plant), rig, made(), points, p, reference, ("position",))
    start = Equilibrium(points.x[1], points.u[1], 0.0)
    loop = SampledLoop(Engine(replace(plant, p=p[1])), rig, made(), start)
    at = plant.observe(start.x, start.u, p[1])[0, plant.output("position")]
    alone = loop.run(at + reference).record.signals["position"]
    assert np.abs(lanes.signals["position"][1] - alone).max() < 1e-11
    assert lane_controller(OnLoadCell(inner, 1e7)) is not None


def courses(spec, measurements, references):
    """Commands [lanes, k] in lanes and one by one, on the same signals; the drives do what is demanded."""
    names, lanes = ("position", "pa", "pb"), measurements.shape[0]
    together, alone = lane_controller(spec.build(PERIOD)), [spec.build(PERIOD) for _ in range(lanes)]
    first = dict(zip(names, measurements[:, 0].T, strict=True))
    together.reset(references[:, 0], first, np.zeros(lanes))
    for lane, controller in enumerate(alone):
        controller.reset(references[lane, 0], {name: first[name][lane] for name in names}, 0.0)
    commands = [[], []]
    for k in range(measurements.shape[1]):
        signals = dict(zip(names, measurements[:, k].T, strict=True))
        demanded = together.compute(references[:, k], signals)
        together.update(demanded)
        commands[0].append(demanded)
        each = [
            controller.compute(references[lane, k], {name: signals[name][lane] for name in names})
            for lane, controller in enumerate(alone)
        ]
        for controller, command in zip(alone, each, strict=True):
            controller.update(command)
        commands[1].append(each)
    return np.array(commands), alone


def random_signals(lanes, instants):
    random, measurements = np.random.default_rng(1), np.full((lanes, instants, 3), 1e7)
    measurements += random.normal(0, 1e5, measurements.shape)
    measurements[..., 0] = random.normal(0, 0.02, (lanes, 1)) + random.normal(0, 1e-4, (lanes, instants))
    return measurements, np.tile(random.normal(0, 0.1, (lanes, 1)), (1, instants))


def test_bad_samples_touch_their_own_lane_only():
    measurements, references = random_signals(4, 60)
    measurements[1, 20:23, 1], measurements[2, 30, 0], references[3, 10:15] = np.nan, np.inf, np.nan
    (together, alone), _ = courses(SPECS["mpc"], measurements, references)
    assert np.isfinite(together).all()
    assert together == pytest.approx(alone, abs=1e-9)


def test_a_solver_that_does_not_arrive_falls_back_in_lanes_as_well():
    spec = replace(SPECS["mpc-bare"], design=replace(SPECS["mpc-bare"].design, pressure=5e6, iterations=10))
    (together, alone), controllers = courses(spec, *random_signals(4, 60))
    assert sum(controller.fallbacks for controller in controllers) > 0
    assert together == pytest.approx(alone, abs=1e-9)


def test_a_controller_that_computes_in_another_way_has_no_lanes():
    class Other(Mpc):
        def compute(self, reference, measurement):
            return 0.0

    other = Other(Mpc.Design(**{name: getattr(SPECS["mpc-bare"].design, name) for name in ("inertia", *JACK)}), PERIOD)
    assert not plays_in_lanes(other)
    assert plays_in_lanes(SPECS["mpc-bare"].build(PERIOD))
