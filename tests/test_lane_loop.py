"""Loops in lanes are the loops one by one, compiled or in a form of their own: points, commands, trips, noise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controllers.lap_inverse import LapInverse
from controllers.p import P
from controllers.shaping import Shaping
from workbench.commands.run.options import load_config
from workbench.control.compensators import compensated
from workbench.control.protocol import graph_law
from workbench.engine import Engine
from workbench.engine.buffered import BufferedFunction
from workbench.engine.instant import watched_readings
from workbench.linear import Equilibrium, equilibrium
from workbench.linear.equilibria import equilibria
from workbench.link.bench import bench
from workbench.link.datagrams import read_reading
from workbench.link.served_rig import ServedRig
from workbench.loop import step_metrics
from workbench.loop.batch import play_lanes, run_lanes
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.loop.sensors import Disturbance, Sensors, logged_lanes
from workbench.plant import build
from workbench.rigs.rig_file import load_rig
from workbench.rigs.sensor import Sensor

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
SPECS = {
    spec.name: spec
    for name in ("position_tuned.toml", "position_mpc.toml")
    for spec in load_config(EXPERIMENTS / name).controllers
}
LANES, INSTANTS, PERIOD, STEP = 6, 300, 1e-3, 0.01


@pytest.fixture(scope="module")
def rig():
    return with_delay(load_rig("jack-10t"), 0.3e-3)


@pytest.fixture(scope="module")
def plant(rig):
    return build(rig)


@pytest.fixture(scope="module")
def drawn(plant):
    """Parameters [lanes, k] and places in the stroke [lanes] m."""
    random, p = np.random.default_rng(2), np.tile(plant.p, (LANES, 1))
    for name, low, high in (("M", 0.5, 1.5), ("beta", 0.5, 1.15), ("Ps", 0.8, 1.03)):
        p[:, plant.parameters.index(name)] *= random.uniform(low, high, LANES)
    return p, np.linspace(-0.216, 0.12, LANES)


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


def both(rig, plant, drawn, spec, step, seed=None, lanes=range(LANES), force=5e3):
    """What lanes did, and some of them each by itself in Python, along a step [m] from where they stand and a step of
    force [N]. `spec`: one controller, or one for each lane, such as designs of one."""
    (p, places), load = drawn, {"disturbance": np.where(np.arange(INSTANTS) < 150, 0.0, force)}
    points, reference, measured = equilibria(plant, p, places), np.full(INSTANTS, step), ("position", "pa")
    designs = spec if isinstance(spec, list) else [spec] * LANES
    start = Engine(plant), rig
    if isinstance(spec, list):
        laws = [graph_law(design.build(PERIOD)) for design in spec]
        ((_, together),) = run_lanes(*start, laws, points, p, reference, measured, seed, load)
    else:
        ((_, together),) = play_lanes(*start, spec.build(PERIOD), points, p, reference, measured, seed, load)
    alone = {}
    for lane in lanes:
        at, engine = Equilibrium(points.x[lane], points.u[lane], 0.0), Engine(replace(plant, p=p[lane]))
        loop = SampledLoop(engine, rig, designs[lane].build(PERIOD), at, seed, compiled=False)
        position = plant.observe(at.x, at.u, p[lane])[0, plant.output("position")]
        alone[lane] = loop.run(position + reference, load)
    return together, alone


def same(together, alone, position, command):
    """To so much, in m and in 1."""
    for lane, run in alone.items():
        assert np.abs(together.signals["position"][lane] - run.record.signals["position"]).max() < position
        assert np.abs(together.demanded[lane] - run.demanded).max() < command
        assert np.abs(together.sent[lane] - run.record.signals["command"]).max() < command


@pytest.mark.parametrize("name", ["p", "p-dp", "crone3"])
@pytest.mark.parametrize("seed", [None, 4])
def test_a_compiled_lane_is_the_loop_by_itself(rig, plant, drawn, name, seed):
    lanes = (0, LANES - 1) if seed is None else (0,)  # the seed of lane 0 is a loop's own
    same(*both(rig, plant, drawn, SPECS[name], STEP, seed, lanes), 1e-6 * STEP, 1e-6)


@pytest.mark.parametrize("name", ["mpc", "mpc-preview", "mpc-bare"])
@pytest.mark.parametrize("step", [0.01, 0.1])
def test_every_lane_of_a_programme_is_the_loop_by_itself(rig, plant, drawn, name, step):
    together, alone = both(rig, plant, drawn, SPECS[name], step)
    same(together, alone, 1e-9 * step, 1e-9)
    assert not together.failed.any()
    assert not together.trip.any()


def test_designs_run_in_lanes_as_they_do_one_by_one(rig, plant, drawn):
    spec = SPECS["p-dp"]
    designs = [replace(spec, design=replace(spec.design, gain=gain)) for gain in np.linspace(1, 4, LANES)]
    same(*both(rig, plant, drawn, designs, STEP, lanes=(0, 3, LANES - 1)), 1e-6 * STEP, 1e-6)


def test_laws_of_different_forms_are_no_lanes(rig, plant, drawn):
    p, places = drawn
    laws = [graph_law(SPECS[name].build(PERIOD)) for name in ("p", "p-dp")]
    with pytest.raises(ValueError, match="same signals"):
        next(run_lanes(Engine(plant), rig, laws, equilibria(plant, p, places), p, np.zeros(9), ("position",)))


def test_limits_bind_in_a_step_of_100_mm(rig, plant, drawn):
    free = SPECS["mpc"].design
    free = replace(free, pressure=1e8, speed=100.0, command_rate=1e4)
    spec = replace(SPECS["mpc"], design=free)
    p, points = drawn[0], equilibria(plant, *drawn)
    demanded = [
        next(play_lanes(Engine(plant), rig, each.build(PERIOD), points, p, np.full(100, 0.1), ()))[1].demanded
        for each in (SPECS["mpc"], spec)
    ]
    assert np.abs(demanded[1] - demanded[0]).max(axis=1).min() > 0.02


def test_the_noise_of_the_first_lane_is_that_of_a_loop(rig, plant, drawn):
    same(*both(rig, plant, drawn, SPECS["mpc"], 0.1, seed=5, lanes=[0]), 1e-10, 1e-9)


@pytest.mark.parametrize(("name", "position", "command"), [("p-dp", 1e-7, 1e-6), ("mpc", 1e-10, 1e-9)])
def test_a_lane_that_trips_goes_to_command_0_and_leaves_the_others_alone(rig, plant, drawn, name, position, command):
    far = drawn[0], np.where(np.arange(LANES) == 3, 0.2395, -0.1)
    together, alone = both(rig, plant, far, SPECS[name], 0.0, lanes=[1, 3], force=-6e4)
    assert together.why(3) == "stroke"
    assert alone[3].tripped.startswith("position beyond")
    assert not np.delete(together.trip, 3).any()
    assert not together.failed.any()
    assert together.sent[3, -1] == 0.0
    same(together, alone, position, command)


@pytest.mark.parametrize("name", ["p-dp", "mpc"])
def test_a_lane_that_cannot_be_simulated_has_no_signals_from_there_on(rig, plant, drawn, name):
    p, points = drawn[0], equilibria(plant, *drawn)
    broken = p.copy()
    broken[4, plant.parameters.index("Ps")] = np.nan
    ((_, lanes), (_, sound)) = (
        next(play_lanes(Engine(plant), rig, SPECS[name].build(PERIOD), points, each, np.full(50, 0.01), ("position",)))
        for each in (broken, p)
    )
    others = np.arange(LANES) != 4
    assert lanes.failed.tolist() == (~others).tolist()
    assert np.isnan(lanes.sent[4, 1:]).all()
    assert lanes.signals["position"][others] == pytest.approx(sound.signals["position"][others])


def test_what_is_around_a_controller_is_in_lanes_as_well(rig, plant, drawn):
    p, points = drawn[0], equilibria(plant, *drawn)

    def made():
        shaped = compensated(SPECS["mpc"].build(PERIOD), Shaping(Shaping.Design(corner=20.0, lead=3e-3), PERIOD))
        return compensated(shaped, LapInverse(LapInverse.Design(excess=2e-3, width=2e-3), PERIOD))

    reference = np.full(100, 0.01)
    ((_, lanes),) = play_lanes(Engine(plant), rig, made(), points, p, reference, ("position",))
    start = Equilibrium(points.x[1], points.u[1], 0.0)
    loop = SampledLoop(Engine(replace(plant, p=p[1])), rig, made(), start)
    at = plant.observe(start.x, start.u, p[1])[0, plant.output("position")]
    alone = loop.run(at + reference).record.signals["position"]
    assert np.abs(lanes.signals["position"][1] - alone).max() < 1e-11


def test_metrics_in_lanes_are_those_one_by_one():
    random, t = np.random.default_rng(1), np.arange(1000) * 1e-3
    rate, swing = random.uniform(5, 60, 20), random.uniform(0, 0.5, 20)
    y = 0.02 + STEP * (1 - np.exp(-rate[:, None] * t) * (1 + swing[:, None] * np.sin(60 * t)))
    y[0, -1], y[1, 3] = 0.0, np.nan  # out of the band at the end; not simulated
    settled = step_metrics.settling_times(t, y, np.full(20, 0.02 + STEP), 0.02 * STEP).tolist()
    beyond = step_metrics.overshoots(y, np.full(20, 0.02 + STEP), STEP)
    assert np.isnan(settled[:2]).all()
    for row, settling, overshoot in list(zip(y, settled, beyond, strict=True))[2:]:
        assert settling == step_metrics.settling_time(t, row, 0.02 + STEP, 0.02 * STEP)
        assert overshoot == pytest.approx(step_metrics.overshoot(row, 0.02, 0.02 + STEP), abs=1e-9)


def test_a_reading_half_way_between_two_steps_is_the_upper_one_wherever_it_is_read():
    """In Python, in lanes, in compiled loops, which environments run, and at a served rig."""
    step, halves = 2.0**-10, np.array([-1.5, -0.5, 0.5, 1.5, 2.5])
    rig = replace(load_rig("jack-10t"), sensors={"position": Sensor(0.0, step)})
    plant, above = build(rig), np.array([-1, 0, 1, 2, 3]) * step
    engine, p = Engine(plant), np.tile(plant.p, (5, 1))
    points = equilibria(plant, p, halves * step)
    points.x[:, plant.state("x")] = halves * step
    outputs = engine.outputs(points.x[:, None], points.u[:, None])[:, 0]
    true = outputs[:, plant.output("position")]
    assert true.tolist() == (halves * step).tolist()

    sensors = Sensors(rig, plant.outputs, 1)
    assert [sensors.read(row)["position"] for row in outputs] == above.tolist()
    assert sensors.readings(outputs, np.zeros((5, 1)))[:, 0].tolist() == above.tolist()
    assert logged_lanes(true[:, None], "position", rig, plant.outputs, 1)[:, 0].tolist() == above.tolist()

    served = ServedRig(bench(rig, computes=False), 1)
    law = P(P.Design(gain=1.0), PERIOD)  # a reference where the reading is demands what holds the jack
    for x, u, reading in zip(points.x, points.u, above, strict=True):
        for compiled in (False, True):
            loop = SampledLoop(engine, rig, law, Equilibrium(x, u, 0.0), 1, compiled)
            assert loop.run(np.array([reading])).demanded == pytest.approx(u[0], abs=1e-9)
        served.put_at(x, u)
        served.sample()
        told = read_reading(bytes(served.reading()[7:]))
        assert told is not None
        assert told.values == (reading,)
    for _, block in run_lanes(engine, rig, graph_law(law), points, p, (above - true)[:, None], ("position",), 1):
        assert block.demanded[:, 0] == pytest.approx(points.u[:, 0], abs=1e-9)


def test_a_served_rig_reads_to_the_bit_what_lanes_do_and_knows_the_first_limit_that_is_left():
    random, columns, quanta = np.random.default_rng(5), [4, 1, 3], [0.0, 1e-3, 0.3]
    served = BufferedFunction(watched_readings(6, columns, quanta, [1, 5]))
    outputs, noise, middles, sizes = served.given
    middles[:], sizes[:] = (0.5, -1.0), (2.0, 1.0)
    lanes, normal = random.normal(0.0, 2.0, (300, 6)), random.normal(0.0, 1e-3, (300, 3))
    lanes[:3, 1], lanes[:3, 5] = (2.5, 0.0, np.nan), (0.0, np.nan, np.nan)
    found = []
    for outputs[:], noise[:] in zip(lanes, normal, strict=True):
        served.evaluate()
        found.append(served.found.copy())
    readings, trips = np.split(np.array(found), [3], axis=1)
    assert np.array_equal(readings, Disturbance(1.0, quanta).readings(lanes[:, columns], normal), equal_nan=True)
    beyond = ~(np.abs(lanes[:, [1, 5]] - middles) <= sizes)
    assert trips[:, 0].tolist() == np.where(beyond[:, 0], 1, np.where(beyond[:, 1], 2, 0)).tolist()
    assert trips[:3, 0].tolist() == [0, 2, 1]
