"""The limit: the fastest motion is the one known by heart where there is one, and the engine plays what was found."""

import json
from dataclasses import replace

import numpy as np
import pytest
from made_plants import carriage

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.limit.study import placed_steps
from workbench.engine.collocation import MotionConstraints
from workbench.engine.fastest import Aim, Course, fastest_course
from workbench.loop import limit as limits
from workbench.loop.capability import oil_stiffness
from workbench.loop.limit import settling_limit, times_limit
from workbench.loop.scenarios import SCENARIOS
from workbench.rigs.oil import ATMOSPHERE
from workbench.rigs.rig_file import load_rig


def carriage_course(band, hold=1.0):
    zero, inf = np.zeros(2), np.full(2, np.inf)
    aim = Aim(
        MotionConstraints(carriage(), zero, np.zeros(1), -inf, inf, 1e4), "position", 1.0, (1 - band, 1 + band), hold
    )
    guess = Course(np.array([0.0, 1.0, 2.0]), np.array([[0, 0], [1, 0], [1, 0]], float), np.zeros((2, 1)), 1.0)
    return fastest_course(aim, 48, guess, near=False)


@pytest.mark.parametrize("band", [0.02, 0.1])
def test_a_double_integrator_is_driven_by_full_command_one_way_then_the_other(band):
    """It enters the band at v = 2 sqrt(band), from which full braking stops at its far edge; before, bang-bang."""
    course = carriage_course(band)
    assert course.arrives == pytest.approx(2 * np.sqrt(1 + band) - 2 * np.sqrt(band), rel=2e-3)
    moving = course.u[: int(np.searchsorted(course.t, course.arrives)), 0]
    assert moving[0] == pytest.approx(1, abs=1e-3)
    assert moving[-1] == pytest.approx(-1, abs=1e-3)
    assert np.mean(np.abs(moving) > 0.99) > 0.9
    assert course.x[:, 0].max() <= 1 + band + 1e-6
    assert abs(course.x[-1, 1]) < 1e-6


def test_it_arrives_later_where_it_has_less_time_to_come_to_rest():
    slow, quick = carriage_course(0.02, hold=0.05), carriage_course(0.02)
    assert slow.arrives > quick.arrives


@pytest.fixture(scope="module")
def rig():
    return load_rig("jack-10t")


@pytest.fixture(scope="module")
def ten(rig):
    return settling_limit(rig, SCENARIOS["position-10mm"])


def test_ten_millimetres_take_a_third_of_what_the_best_loop_needs(ten):
    """From outside, by another program on a mesh of 1 ms: 0.024 s, and 0.020 s only below the vapour's pressure."""
    assert 0.020 < ten.settling < 0.024
    assert ten.mesh_difference < 0.005 * ten.settling
    assert abs(ten.lowest_pressure - ATMOSPHERE) < 0.5e5  # it is the oil's gas that holds it back
    assert ten.peak_command < 1


def test_the_engine_plays_what_was_found(ten):
    y, t = ten.signals["position"], ten.signals["t [s]"]
    settled = np.abs(y[t >= ten.settling - 1e-9] - 10e-3)
    assert ten.off < 0.2 * ten.band
    assert settled.max() < 1.2 * ten.band
    assert abs(y[t < ten.settling - 1e-9][-1] - 10e-3) > 0.8 * ten.band  # and no sooner


def test_a_command_keeps_its_rate(rig, ten):
    """From one interval's middle to the next."""
    t = ten.signals["t [s]"]
    middles = np.append(t[0], (t[1:] + t[:-1]) / 2)
    changes = np.diff(np.append(0.0, ten.signals["command"][:-1])) / np.diff(middles)
    assert np.abs(changes).max() <= rig.limit("command_rate") * (1 + 1e-5)


def test_pressure_in_hand_costs_time_and_is_kept(rig, ten):
    kept = settling_limit(rig, SCENARIOS["position-10mm"], margin=26e5)
    assert kept.lowest_pressure > 25e5
    assert ten.settling < kept.settling < 0.030  # outside: 0.030 s with 26 bar


def test_a_late_drive_adds_its_delay(monkeypatch, rig, ten):
    from workbench.loop.rig_variations import with_delay

    late = settling_limit(with_delay(rig, 2e-3), SCENARIOS["position-10mm"])
    assert late.settling == pytest.approx(ten.settling + 2e-3, rel=1e-3)


def test_a_limit_is_computed_once_and_comes_back_as_it_was(monkeypatch, tmp_path, rig):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(limits, "_MESHES", (12, 24))
    scenario = replace(SCENARIOS["position-10mm"], size=12e-3)
    first = settling_limit(rig, scenario)
    monkeypatch.setattr(limits, "fastest_course", None)
    again = settling_limit(rig, scenario)
    assert again.settling == first.settling
    assert all(np.array_equal(again.signals[name], first.signals[name]) for name in first.signals)


@pytest.mark.parametrize(
    ("change", "margin", "reason"),
    [
        ({"rate": 0.1}, 0.0, "not a step"),
        ({"start_share": 0.99}, 0.0, "beyond the stroke"),
        ({}, 150e5, "below the margin"),
    ],
)
def test_what_has_no_limit_says_why(rig, change, margin, reason):
    limit = settling_limit(rig, replace(SCENARIOS["position-10mm"], **change), margin)
    assert limit.settling is None
    assert reason in limit.reason


def test_what_is_impossible_is_not_found(rig):
    """At 0.1 mm/s, 100 mm take more than a hundred times what is watched."""
    crawling = replace(rig, limits={**rig.limits, "speed": replace(rig.limits["speed"], value=1e-4)})
    assert settling_limit(crawling, SCENARIOS["position-100mm"]).settling is None


def test_away_from_the_middle_a_motion_is_found_though_two_guesses_lead_nowhere(rig):
    outwards = replace(SCENARIOS["position-10mm"], start=0.12)
    assert settling_limit(rig, outwards).settling == pytest.approx(0.0207, rel=0.01)


def test_times_the_limit_where_both_are_known():
    assert times_limit(0.06, 0.02) == pytest.approx(3)
    assert times_limit(None, 0.02) is None
    assert times_limit(0.06, None) is None


def test_steps_start_at_three_places_and_press_on_every_specimen():
    steps = placed_steps(BenchConfig.load("experiments/benchmark.toml"))
    ten = [step.position for step in steps if step.scenario.name == "position-10mm"]
    assert ten == pytest.approx([-0.12, 0.0, 0.12])
    force = {(step.position, step.rig.specimen_stiffness) for step in steps if step.scenario.name == "force-20kn"}
    assert len(force) == 6
    assert {stiffness for _, stiffness in force} == {1e7, 1e6}
    assert [step.position for step in steps if step.scenario.name == "position-load-20kn"] == [0.0]


def test_a_force_presses_on_three_specimens_softer_and_stiffer_than_the_oil(rig):
    steps = placed_steps(BenchConfig.load("experiments/limits.toml"))
    stiffness = {step.rig.specimen_stiffness for step in steps if step.scenario.signal == "force"}
    assert stiffness == {1e6, 1e7, 1e8}
    assert min(stiffness) < oil_stiffness(rig) < max(stiffness)


def test_a_rig_of_the_set_with_another_specimen_counts_whole(rig):
    """Its mass and its oil too: those of the hardest plants of a force loop."""
    steps = placed_steps(BenchConfig.load("experiments/limits_force.toml"))
    light = next(step.rig for step in steps if step.of == "soft-light")
    assert (light["M"], light["beta"], light["ks"]) == pytest.approx((0.5 * rig["M"], 0.5 * rig["beta"], 1e6))
    assert len({step.name for step in steps}) == len(steps) == 4 * (3 + 1 + 1)


def test_a_linear_plant_has_no_limit():
    with pytest.raises(InputError, match="no chambers"):
        placed_steps(load_steps("experiments/linear_plant.toml"))


ONE = """
experiment = "step"
rig = "jack-10t"
scenarios = ["10mm", "sine", "push"]
[scenario.10mm]
size = "10 mm"
start = "1 mm"
seconds = "1 s"
[scenario.sine]
size = "1 mm"
frequency = "5 Hz"
seconds = "0.1 s"
[scenario.push]
load = "1 kN"
seconds = "1 s"
[controllers.p]
use = "controllers.p:P"
gain = {value = 3.7, unit = "1/m"}
[bode]
low_hz = 2
high_hz = 20
points = 3
amplitudes_mm = [1]
"""


def test_the_command_leaves_rows_a_page_and_the_motions(tmp_path, capsys):
    (tmp_path / "one.toml").write_text(ONE)
    assert main(["limit", str(tmp_path / "one.toml"), "--jobs", "1", "--out", str(tmp_path / "out")]) == 0
    step, sine, push = json.loads((tmp_path / "out/metrics.json").read_text())["rows"]
    assert step["scenario"] == "10mm"
    assert step["x_m"] == pytest.approx(1e-3)
    assert 0.02 < step["limit_s"] < 0.024
    assert {"lowest_pressure_bar", "peak_command", "mesh_difference_s"} <= step.keys()
    assert step["lowest_pressure_bar"] > 1
    assert step["cavitation_s"] == sine["cavitation_s"] == 0  # the limit keeps its chambers above 1 atm
    assert push["cavitation_s"] is push["lowest_pressure_bar"] is None
    assert sine["limit_s"] is None
    assert 0 < sine["limit_error"] < sine["largest_error"] < 1e-3
    assert push["limit_error"] is None
    assert "far end" in push["reason"]
    said = capsys.readouterr().out
    assert "sine within" in said
    differs = 100 * step["mesh_difference_s"] / step["limit_s"]
    assert f"The soonest that the optimiser finds, on two meshes within {differs:.1g} %: 10mm in 0.02" in said
    assert "1 of 3 rows" in said
    assert list((tmp_path / "out").glob("*.parquet"))


@pytest.mark.parametrize("margin", ["-1 bar", "5 mm", "nan bar", "much"])
def test_a_margin_that_is_no_pressure_is_refused(tmp_path, capsys, margin):
    assert main(["limit", "experiments/benchmark.toml", f"--margin={margin}", "--out", str(tmp_path / "out")]) == 2
    assert "--margin" in capsys.readouterr().err
