"""Guards of six legs: a runaway stops within the stroke on every payload, all legs brake, and sound motions go on."""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest

from controllers import P
from workbench.commands.learn.options import PlatformLearnConfig, load_any
from workbench.commands.run.options import load_config
from workbench.commands.run.platform_config import PlatformConfig
from workbench.control.law import LawController, static_law
from workbench.control.platform_controller import PlatformController
from workbench.control.platform_law import direct_law
from workbench.engine.guard_rules import COUPLED, GuardSteps, coupled
from workbench.engine.guard_shape import BESIDE, TRIPS, packed
from workbench.engine.instant import controller_instant
from workbench.loop.guard_numbers import guard_numbers, guard_shape, left_to_brake
from workbench.loop.platform import platform_setup, run_platform
from workbench.loop.platform.compiled import CompiledPlatform, LegSensors, coupling_numbers
from workbench.rigs.platform import AXES, leg_speeds
from workbench.rigs.rig_file import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
CONFIG = cast(PlatformConfig, load_config(EXPERIMENTS / "hexapod.toml"))
STROKE, END = 0.24, 0.25  # m
HELD = 0.002  # m: of a stop that the oil and the valve's lag leave open
BLIND = PlatformController([P(gain=0.001).build(1e-3) for _ in range(6)], np.eye(6))
READ = ("position", "pa", "pb", "supply", "spool")


@pytest.fixture(scope="module")
def setup():
    return platform_setup(CONFIG.rig, CONFIG.delay)


def other(setup, factor, **values):
    """The same on a payload that its guards do not know."""
    payload = {name: factor * setup.platform[name] for name in ("mass", "Ixx", "Iyy", "Izz")}
    return platform_setup(CONFIG.rig.with_values(**payload, **values), CONFIG.delay).known_as(setup)


def runaway(setup, axis, size, compiled=True, seed: int | None = 1, steps=600):
    """Commands [6] that move one axis, of which the largest is `size`, from 20 ms on, whatever the laws say."""
    pattern = leg_speeds(setup.platform.geometry, np.zeros(6))[:, AXES.index(axis)]
    added = np.tile(setup.null.u[:6], (steps, 1))
    added[20:] += size * pattern / np.abs(pattern).max()
    return run_platform(setup, BLIND, np.zeros((steps, 6)), seed, compiled, added=added)


@pytest.mark.parametrize(
    ("factor", "values"),
    [(1.0, {}), (1.25, {}), (1.25, {"cz": 1.0}), (0.075, {})],
    ids=["declared", "heavy", "heavy and high", "light"],
)
def test_a_runaway_stops_before_the_end_of_the_stroke(setup, factor, values):
    """Down, with gravity helping, up, and in the directions in which a leg moves most and least."""
    there = other(setup, factor, **values)
    for axis in ("heave", "surge", "pitch", "yaw"):
        for size in (-1.0, -0.3, 0.3, 1.0):
            run = runaway(there, axis, size)
            assert any(what in (run.tripped or "") for what in ("too fast to stop", "speed above"))
            most = np.abs(run.legs("position")).max()
            assert most < END - HELD, (axis, size, most)
            assert np.abs(run.legs("velocity")[-125:].mean(axis=0)).max() < 0.02  # it swings on the shut-in oil


def test_where_one_leg_trips_the_others_brake_as_it_does(setup):
    """A valve that is shut at speed gives the oil blows of ten times the allowed force."""
    for axis in ("surge", "roll"):
        for size in (-0.3, 0.3):
            run = runaway(setup, axis, size)
            assert np.abs(run.legs("jack_force")).max() < 1.6 * 90e3


@pytest.mark.parametrize("seed", [None, 3])
def test_a_runaway_is_braked_compiled_as_in_python(setup, seed):
    python, compiled = (runaway(setup, "pitch", -0.6, way, seed, 260) for way in (False, True))
    assert python.tripped == compiled.tripped is not None
    assert python.sent == pytest.approx(compiled.sent, abs=1e-7)
    assert python.pose == pytest.approx(compiled.pose, abs=1e-8)


def test_sound_motions_do_not_trip(setup):
    """The steps of the shipped experiment and the quake that is learned, with noise, on the payloads that are drawn."""
    quake = cast(PlatformLearnConfig, load_any(EXPERIMENTS / "learn_platform.toml"))
    motions = [step.pose(setup.platform.period) for step in CONFIG.steps]
    for factor in (0.75, 1.0, 1.25):
        there = other(setup, factor)
        for spec in CONFIG.controllers:
            controller = spec.build(setup.platform.period, setup.directions)
            assert [run_platform(there, controller, pose, 0).tripped for pose in motions] == [None] * len(motions)
        controller = quake.controller.build(setup.platform.period, setup.directions)
        assert run_platform(there, controller, quake.motion.pose, 0).tripped is None


def test_sound_motions_near_the_limits_do_not_trip(setup):
    """Sines that take nine tenths of what stroke, speed and force allow, in directions in which a leg moves little."""
    t = np.arange(1500) * setup.platform.period
    rise = np.clip(t / 0.5, 0, 1)
    for axis, most, hz in (("heave", 0.331, 2.0), ("pitch", 0.212, 2.0)):
        pose = np.outer(0.9 * most * rise**2 * (3 - 2 * rise) * np.sin(2 * np.pi * hz * t), np.eye(6)[AXES.index(axis)])
        for spec in CONFIG.controllers:
            controller = spec.build(setup.platform.period, setup.directions)
            assert run_platform(setup, controller, pose, 1).tripped is None, (axis, spec.name)


def test_without_pressures_each_guard_is_that_of_a_jack(setup):
    """They alone tell what the other legs do to one. Where one trips, the others brake, too."""
    every = LegSensors.of(setup, (), False)
    own = every.picked(("position",))
    only = {name: getattr(every, name)[:, own] for name in ("noise", "resolution", "places")}
    loop = CompiledPlatform(setup, replace(every, names=("position",), **only), direct_law())
    instant, guard, still = controller_instant(loop.shape), loop.shape.guard, np.zeros(6)
    state, numbers, size = loop.memory(still, np.zeros(0)), loop.numbers(still), len(loop.memory(still, np.zeros(0)))
    jacks = [
        GuardSteps(guard, packed(guard.numbers, **guard_numbers(rig, guard, (), False, carried)))
        for rig, carried in zip(setup.guarded, setup.carried, strict=True)
    ]
    middle, random = np.array([rig.middle for rig in setup.guarded]), np.random.default_rng(0)
    sent, trips, alone = still, still, list[tuple[float, int]]()
    for k in range(300):
        position, demanded = middle + 0.05 * np.sin(0.01 * k + np.arange(6)), random.uniform(-1.2, 1.2, 6)
        position[2] += 0.5 * (k == 299)
        for jack, at, command in zip(jacks, position, sent, strict=True):
            jack.watch({"position": at}, command, np.nan)
        alone = [jack.limit(u, command) for jack, u, command in zip(jacks, demanded, sent, strict=True)]
        found = np.array(instant(state, np.concatenate((middle, demanded, position)), numbers)).ravel()
        state, sent, trips = found[:size], found[size : size + 6], found[-6:]
        if k < 299:
            assert sent == pytest.approx([command for command, _ in alone], abs=1e-12)
    assert [trip for _, trip in alone] == [0, 0, trips[2], 0, 0, 0]
    assert trips[2] > 0
    assert set(np.delete(trips, 2)) == {BESIDE}


def coupling(numbers, speeds, pressed):
    """What the guards compute of it, accelerations and decelerations [6]."""
    q = {name: ca.DM(numbers[place]) for name, place in COUPLED.items()}
    return (np.array(part).ravel() for part in coupled(q, ca.DM(speeds), ca.DM(pressed)))


def test_legs_that_are_alike_brake_a_mode_with_its_mass(setup):
    """Along a direction that decouples, every push is that of one mass; braking leaves room for a heavier payload."""
    numbers, still, along = coupling_numbers(setup), np.zeros(6), setup.directions[:, 2]
    loads = np.array([carried.load for carried in setup.carried])
    accelerated, _ = coupling(numbers, still, loads + 1e4 * along)
    assert accelerated == pytest.approx(1e4 * along / setup.masses[2], rel=1e-6)
    _, braked = coupling(numbers, 2.0 * along, loads)
    left = left_to_brake(setup.guarded[0], setup.carried[0])
    assert 0.7 * left / setup.masses[2] < braked.min()
    assert braked.max() < left / setup.masses[2]
    _, slowest = coupling(numbers, still, np.full(6, np.nan))
    assert slowest == pytest.approx(left / setup.masses.max(), rel=1e-6)


def weighed():
    """A proportional law that has the load cells read, too."""
    return LawController(static_law([3.0, -3.0, 0.0], ("position", "force"), 1e-3))


def test_load_cells_that_a_law_reads_agree_with_the_rods(setup):
    """Between pressures and load cell there is the leg's rod, not the payload; compiled as in Python."""
    pose = np.zeros((300, 6))
    pose[:, 4] = 0.02 * np.clip(np.arange(300) * setup.platform.period / 0.1, 0, 1)
    laws = [cast(Any, weighed()) for _ in range(6)]
    controller = PlatformController(laws, np.eye(6))
    python, compiled = (run_platform(setup, controller, pose, 2, way) for way in (False, True))
    assert python.tripped is compiled.tripped is None
    assert python.sent == pytest.approx(compiled.sent, abs=1e-9)
    driven = np.zeros((300, 6))
    driven[20:] = 1.0
    python, compiled = (run_platform(setup, controller, 0 * pose, 2, way, added=driven) for way in (False, True))
    assert python.tripped == compiled.tripped is not None
    assert python.sent == pytest.approx(compiled.sent, abs=1e-7)


def test_a_leg_holds_its_share_of_the_payload(setup):
    weight = 9.81 * (CONFIG.rig["mass"] + sum(leg.numbers["rod_mass"].value for leg in CONFIG.rig.legs))
    for carried in setup.carried:
        assert carried.least < carried.most
        assert carried.least == pytest.approx(min(setup.masses))
        assert weight / 6 < carried.load < 2 * weight / 6
        assert 0 < carried.weight < 9.81 * carried.cell
    level = platform_setup(CONFIG.rig.with_values(gravity=0.0), CONFIG.delay)
    assert [carried.load for carried in level.carried] == pytest.approx([0.0] * 6, abs=1.0)


def test_a_jack_alone_carries_nothing_else():
    rig = load_rig("jack-10t")
    shape = guard_shape(rig, READ, ("position",))
    numbers = guard_numbers(rig, shape, ("position",), True)
    assert not shape.leg
    assert numbers["mass"] == rig["M"]
    assert numbers["weight"] == numbers["drag"] == 0.0


def test_a_load_that_leaves_nothing_to_brake_with_is_no_trip_at_rest(setup):
    carried = replace(setup.carried[0], load=95e3)
    rig = setup.guarded[0]
    numbers = guard_numbers(rig, guard_shape(rig, READ, ("position",), carried), ("position",), True, carried)
    assert cast(float, numbers["braking"]) > 0
    assert cast(float, numbers["fade"]) > 0


def test_the_number_of_the_trip_beside_is_the_last():
    """Recorded numbers of trips stay what they were."""
    assert TRIPS[BESIDE] == "beside"
    assert len(TRIPS) - 1 == BESIDE
