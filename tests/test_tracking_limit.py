"""The least error of a reference that moves: exact where it is known by heart, and played by the engine on a jack."""

from dataclasses import replace

import numpy as np
import pytest
from made_plants import carriage

from workbench.commands.common.step_experiment import load_steps
from workbench.engine.collocation import MotionConstraints
from workbench.engine.nearest import RecedingHorizon, Wish, nearest_course
from workbench.loop.limit import BELOW, NO_CHAMBERS
from workbench.loop.rows import judge, linear_loops, loop_setup
from workbench.loop.scenarios import SCENARIOS, Scenario
from workbench.loop.tracking_limit import tracking_limit
from workbench.rigs.oil import ATMOSPHERE
from workbench.rigs.rig_file import load_rig


def carriage_error(acceleration):
    """Root mean square on the way that starts at rest and has this acceleration, for 1 s."""
    inf = np.full(2, np.inf)
    motion = MotionConstraints(carriage(), np.zeros(2), np.zeros(1), -inf, inf, 1e4)
    wish = Wish(motion, "position", lambda t: acceleration * t**2 / 2, 1.0, acceleration / 2)
    course = nearest_course(wish, RecedingHorizon(0.02, 10, 20))
    return float(np.sqrt(np.mean((course.x[:, 0] - wish.reference(course.t)) ** 2)))


def test_what_the_command_can_do_is_followed_without_error():
    assert carriage_error(0.5) < 1e-5


@pytest.mark.parametrize("acceleration", [1.5, 3.0])
def test_where_it_asks_for_more_than_the_command_gives_the_error_is_the_rest(acceleration):
    """Full command from the start is the best: the error is (a - 1) t^2 / 2, whose mean square is (a - 1)^2 / 20."""
    assert carriage_error(acceleration) == pytest.approx((acceleration - 1) / 2 / np.sqrt(5), rel=0.05)


@pytest.fixture(scope="module")
def rig():
    return load_rig("jack-10t")


SINE = replace(SCENARIOS["position-sine-5hz"], duration=0.06)


def test_a_sine_within_what_the_jack_can_do_costs_its_start_alone(rig):
    limit = tracking_limit(rig, SINE)
    off = np.abs(limit.signals["position"] - limit.signals["position"][0] - limit.signals["reference"])
    t = limit.signals["t [s]"]
    assert off.max() == pytest.approx(limit.largest)
    assert off[t < 0.02].max() == limit.largest
    assert off[t > 0.03].max() < SINE.size / 200
    assert limit.mesh_difference < 0.1 * limit.error
    assert limit.peak_command < 1


def test_no_loop_follows_nearer(rig):
    setup = loop_setup(rig)
    for spec in load_steps("experiments/position_tuned.toml").controllers:
        _, row = judge(spec, SINE, setup, linear_loops(spec, setup))
        assert row["rms_error"] > tracking_limit(rig, SINE).error


def test_more_force_than_the_jack_has_leaves_an_error_at_the_vapour_s_pressure(rig):
    limit = tracking_limit(rig, Scenario("much", "position", 10e-3, 0.02, frequency=20.0))
    assert limit.error > 1e-3
    assert 0 < limit.lowest_pressure - ATMOSPHERE < 3.5e5


@pytest.mark.parametrize(
    ("change", "margin", "reason"),
    [({"frequency": None}, 0.0, "no reference"), ({"load": 1e3}, 0.0, "load"), ({}, 150e5, BELOW)],
)
def test_what_has_no_least_error_says_why(rig, change, margin, reason):
    limit = tracking_limit(rig, replace(SINE, **change), margin)
    assert limit.error is None
    assert reason in limit.reason


def test_a_linear_plant_has_none():
    config = load_steps("experiments/linear_plant.toml")
    assert tracking_limit(config.rig, SINE).reason == NO_CHAMBERS
