"""Loops on a platform: compiled as in Python, the known case, modal control, guards, the command."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from workbench import InputError
from workbench.base.gain_phase import gain_db
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.platform_motion import PlatformRecord
from workbench.commands.run.options import load_config
from workbench.commands.run.platform_config import PlatformConfig
from workbench.commands.run.study import run_any
from workbench.control.platform_controller import Forward, PlatformController, PlatformSpec, Smoothing
from workbench.linear.crossings import corner_frequency
from workbench.loop.platform import platform_setup, run_platform
from workbench.loop.platform.poses import recorded_pose, road_pose
from workbench.loop.platform.record import check_motion, play
from workbench.loop.platform.rows import judge_variations, platform_sine, step_row
from workbench.loop.platform.steps import AxisStep
from workbench.loop.platform.transfer import platform_transfer
from workbench.rigs.platform import AXES, load_platform

EXPERIMENT = Path(__file__).parents[1] / "experiments" / "hexapod.toml"
CONFIG = cast(PlatformConfig, load_config(EXPERIMENT))
P_DP, MODAL = CONFIG.controllers
F = np.geomspace(0.5, 60, 60)
PERIOD = 1e-3


@pytest.fixture(scope="module")
def setup():
    return platform_setup(CONFIG.rig, CONFIG.delay)


@pytest.fixture(scope="module")
def known():
    """The known case: legs without inertia, the pose that of the centre of mass, no computing delay."""
    bare = CONFIG.rig.without_leg_inertia()
    above, height = bare["cz"], bare["height"]
    legs = tuple(replace(leg, joint=(*leg.joint[:2], -above)) for leg in bare.legs)
    return platform_setup(replace(bare.with_values(cz=0.0, height=height + above), legs=legs))


def stepped(setup, spec, name, **options):
    step, controller = AxisStep.named(name), spec.build(PERIOD, setup.directions)
    run = run_platform(setup, controller, step.pose(PERIOD), **options)
    return run, step_row(spec.name, step, setup, run, platform_transfer(setup, controller, F))


@pytest.mark.parametrize("spec", [P_DP, MODAL], ids=lambda spec: spec.name)
@pytest.mark.parametrize("seed", [None, 3])
def test_a_compiled_loop_is_the_loop_in_python(setup, spec, seed):
    pose = np.zeros((80, 6))
    pose[1:] = 0.004, -0.003, 0.005, 0.004, -0.004, 0.003
    controller = spec.build(PERIOD, setup.directions)
    compiled, python = (run_platform(setup, controller, pose, seed, way) for way in (True, False))
    assert compiled.tripped is None
    assert python.tripped is None
    assert compiled.sent == pytest.approx(python.sent, abs=1e-9)
    assert compiled.pose == pytest.approx(python.pose, abs=1e-10)


def test_equal_laws_on_modes_are_the_laws_on_the_legs(setup):
    pose = AxisStep.named("pitch-1deg").pose(PERIOD)[:200]
    runs = [
        run_platform(setup, PlatformSpec("x", P_DP.laws, modal).build(PERIOD, setup.directions), pose)
        for modal in (False, True)
    ]
    assert runs[0].pose == pytest.approx(runs[1].pose, abs=1e-9)


def test_steps_of_the_known_case(known):
    """Six p-dp loops as first tuned, beside what an independent model of this platform gave."""
    seconds = {"heave-10mm": 0.104, "pitch-1deg": 0.122, "surge-10mm": 0.122, "yaw-1deg": 0.128, "heave-100mm": 0.145}
    runs, rows = {}, {}
    for name, expected in seconds.items():
        runs[name], rows[name] = stepped(known, P_DP, name)
        assert rows[name]["settling_s"] == pytest.approx(expected, abs=1.5e-3)
    assert rows["surge-10mm"]["overshoot_percent"] == pytest.approx(3.3, abs=0.1)
    assert 1e3 * np.abs(runs["pitch-1deg"].pose[:, :3]).max(axis=0) == pytest.approx([0.80, 0.0, 0.72], abs=0.02)
    assert runs["heave-100mm"].signals["lowest_pressure"].min() == pytest.approx(7e5, abs=0.5e5)


def test_transfer_of_the_known_case(known):
    f = np.geomspace(0.5, 60, 200)
    transfer = platform_transfer(known, P_DP.build(PERIOD, known.directions), f)
    assert transfer.stable
    heave, surge = (np.abs(transfer.transfer[:, i, i]) for i in (2, 0))
    assert corner_frequency(f, gain_db(heave), -3.0) == pytest.approx(13.4, abs=0.1)
    assert corner_frequency(f, gain_db(surge), -3.0) == pytest.approx(10.7, abs=0.1)
    assert gain_db(surge).max() == pytest.approx(2.2, abs=0.05)
    at_joints = 1.6 / known.platform.geometry.radius
    assert at_joints * transfer.coupling("pitch", "surge", 5.0) == pytest.approx(0.147, abs=0.005)
    assert at_joints * transfer.coupling("pitch", "surge", 8.9) == pytest.approx(0.346, abs=0.005)


def test_a_light_payload_is_unstable_under_the_same_numbers(known):
    light = known.platform.with_values(mass=300, Ixx=262, Iyy=262, Izz=337)
    setup = platform_setup(light)
    assert not platform_transfer(setup, P_DP.build(PERIOD, setup.directions), F).stable


def test_modal_control_decouples_and_settles(setup):
    transfer = platform_transfer(setup, MODAL.build(PERIOD, setup.directions), F)
    assert transfer.stable
    assert transfer.coupling("pitch", "surge", 5.0) < 0.03
    legs = platform_transfer(setup, P_DP.build(PERIOD, setup.directions), F)
    assert legs.coupling("pitch", "surge", 5.0) > 0.12
    for name in ("heave-10mm", "surge-10mm", "pitch-1deg"):
        assert stepped(setup, MODAL, name, seed=0)[1]["settling_s"] < 0.13


def test_the_linear_transfer_is_that_of_small_sines(setup):
    for spec in (P_DP, MODAL):
        controller = spec.build(PERIOD, setup.directions)
        sine = platform_sine(setup, controller, AXES.index("surge"), 5.0, 1e-4)
        linear = platform_transfer(setup, controller, np.array([5.0])).transfer[0, :, 0]
        assert sine.pose == pytest.approx(linear, abs=0.02)
        assert sine.acceleration == pytest.approx(linear, abs=0.03)


def test_feed_forward_of_a_smooth_reference_takes_the_lag_out(setup):
    """Velocity feed-forward through the kinematics: a slow sine is followed with a tenth of the error."""
    t = np.arange(1000) * PERIOD
    pose = np.zeros((1000, 6))
    pose[:, 3] = 0.03 * np.sin(2 * np.pi * t) ** 3
    errors = []
    for forward in ((), (Forward(7.4, 1e4, 0.0),) * 6):
        controller = PlatformSpec("x", P_DP.laws, forward=forward).build(PERIOD, setup.directions)
        run = run_platform(setup, controller, pose)
        assert run.tripped is None
        errors.append(np.abs(run.pose - pose)[:, 3].max())
    assert errors[1] < 0.25 * errors[0]


def test_payload_and_centre_of_mass_may_change_under_modal_control(setup):
    variations = {"heavy": {"mass": 5000.0}, "light": {"mass": 3000.0}, "aside": {"cx": 0.2, "cy": -0.1}}
    judged = judge_variations(setup, [P_DP, MODAL], variations, CONFIG.steps[:1], 0)
    order = [(row["variation"], row["controller"]) for row in judged[:3]]
    assert order == [("heavy", "p-dp"), ("heavy", "modal"), ("light", "p-dp")]
    for legs, modal in zip(judged[::2], judged[1::2], strict=True):
        assert modal["stable"]
        assert modal["tripped"] is None
        assert modal["settling_s"] < 0.15
        assert modal["coupling_percent"] < 0.3 * legs["coupling_percent"]
    (hopeless,) = judge_variations(
        setup, [P_DP], {"bare": {"mass": 300.0, "Ixx": 262.0, "Iyy": 262.0, "Izz": 337.0}}, CONFIG.steps[:1], 0
    )
    assert not hopeless["stable"]


def test_a_record_is_learned(setup):
    target = road_pose(setup.platform, AXES.index("pitch"), "C", 15.0, 2.0, (0.5, 8.0), 0.01)
    weight = setup.platform.geometry.weights[AXES.index("pitch")]
    assert np.abs(target).max() * weight == pytest.approx(0.01)
    assert np.abs(target[[0, -1]]).max() == 0.0
    played = play(setup, P_DP.build(PERIOD, setup.directions), target, 25.0, 3)
    assert len(played.errors) == 4
    assert min(played.errors) < 0.15 * played.errors[0]
    assert played.best.tripped is None


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_recorded_motion_is_played(setup, tmp_path, suffix):
    """Slower samples than the control's, millimetres and degrees, from a first row that is not home."""
    t = np.arange(0, 1.0001, 0.01)
    heave, pitch = 5 + 10 * np.sin(np.pi * t) ** 2, np.sin(np.pi * t) ** 2
    columns = {"t [s]": t, "heave [mm]": heave, "pitch [deg]": pitch}
    file = tmp_path / f"quake{suffix}"
    if suffix == ".csv":
        np.savetxt(file, np.column_stack(list(columns.values())), "%.9g", ",", header=",".join(columns), comments="")
    else:
        pq.write_table(pa.table(columns), file)
    record = record_of(tmp_path, f'file = "{file.name}"')
    assert record.title == file.name
    at = np.arange(1001) * PERIOD
    assert record.pose[500:1501, 2] == pytest.approx(0.01 * np.sin(np.pi * at) ** 2, abs=1e-6)
    assert record.pose[500:1501, 4] == pytest.approx(np.radians(np.sin(np.pi * at) ** 2), abs=1e-5)
    assert np.abs(record.pose[[0, -1]]).max() == 0.0
    check_motion(setup, record.pose)
    played = play(setup, P_DP.build(PERIOD, setup.directions), record.pose, record.highest, record.iterations)
    assert played.best.tripped is None
    assert min(played.errors) < 0.2 * played.errors[0]


def test_a_record_that_ends_elsewhere_leads_back(setup):
    t = np.linspace(0, 1, 11)
    pose = recorded_pose(setup.platform, t, np.outer(0.02 * t**2 * (3 - 2 * t), np.eye(6)[0]))
    assert pose[1500, 0] == pytest.approx(0.02)
    assert pose[-500:] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(np.diff(pose[:, 0])).max() < 1e-4
    check_motion(setup, pose)


@pytest.mark.parametrize(
    ("axis", "size", "hz", "limit"),
    [(2, 0.6, 0.5, "stroke"), (5, 0.1, 12.0, "speed"), (0, 0.01, 12.0, "force")],
)
def test_a_record_beyond_the_platform_is_refused(setup, axis, size, hz, limit):
    t = np.arange(0, 2.0, PERIOD)
    pose = np.outer(size * np.sin(np.pi * t / 2) ** 2 * np.sin(2 * np.pi * hz * t), np.eye(6)[axis])
    with pytest.raises(InputError, match=rf"^record: leg \d, {limit} at .* s: \d+.* % of its limit; play"):
        check_motion(setup, recorded_pose(setup.platform, t, pose))
    check_motion(setup, recorded_pose(setup.platform, t, 0.1 * pose))


def test_a_leg_that_is_pushed_has_less_speed(setup):
    """Speed and force that a leg has each, but not both at once."""
    acceleration = 60.0 * np.repeat([0.0, 1.0, -1.0, 0.0], 75)
    pose = np.zeros((300, 6))
    pose[:, 2] = np.cumsum(np.cumsum(acceleration)) * PERIOD**2 - 0.17
    with pytest.raises(InputError, match="flow"):
        check_motion(setup, pose)


def record_of(folder, entry):
    text = EXPERIMENT.read_text()
    road = text[text.index("[record]") : text.index("iterations")]
    path = folder / "own.toml"
    path.write_text(text.replace(road, f"[record]\n{entry}\n"))
    return cast(PlatformRecord, cast(PlatformConfig, load_config(path)).record)


@pytest.mark.parametrize(
    ("text", "entry", "said"),
    [
        ("t [s],heav [mm]\n0,0\n1,1\n", "", "heave"),
        ("t [s],heave [deg]\n0,0\n1,1\n", "", "heave"),
        ("t [s],heave\n0,0\n1,1\n", "", "no unit"),
        ("t [s]\n0\n1\n", "", "no column of an axis"),
        ("t [s],yaw [deg]\n1,0\n1,1\n", "", "must rise"),
        ("t [s],yaw [deg]\n0,0\n99,1\n", "", "99 s are above 60 s"),
        ("t [s],yaw [deg]\n0,0\n1,1\n", 'axis = "yaw"', "not together with file"),
    ],
)
def test_files_of_records_are_read_strictly(tmp_path, text, entry, said):
    (tmp_path / "own.csv").write_text(text)
    with pytest.raises(InputError, match=said):
        record_of(tmp_path, f'file = "own.csv"\n{entry}')


def test_one_leg_beyond_its_stroke_stops_all(setup):
    pose = np.zeros((400, 6))
    pose[:, 2] = np.linspace(0, 0.8, 400)
    runs = [run_platform(setup, P_DP.build(PERIOD, setup.directions), pose, None, way) for way in (True, False)]
    for run in runs:
        assert run.tripped is not None
        assert run.tripped.startswith("leg ")
        assert np.abs(run.pose[-1, 3:]).max() < 0.05
    assert runs[0].tripped == runs[1].tripped


def test_a_wrench_pushes_and_the_loop_holds(setup):
    force = np.where(np.arange(600) < 20, 0.0, -5000.0)
    controller = P_DP.build(PERIOD, setup.directions)
    run = run_platform(setup, controller, np.zeros((600, 6)), wrench={"force_z": force})
    assert run.pose[:, 2].min() < -2e-5
    assert abs(run.pose[-1, 2]) < 5e-4


def test_smoothing_is_four_lags():
    smooth = Smoothing(corner=10.0)
    pose = np.zeros((400, 6))
    pose[0:, 1] = 1.0
    pose[:1] = 0.0
    answer = smooth.of(pose, PERIOD)[:, 1]
    a = 2 * np.pi * 10 * (np.arange(400)) * PERIOD
    exact = 1 - np.exp(-a) * (1 + a + a**2 / 2 + a**3 / 6)
    assert answer == pytest.approx(exact, abs=0.03)
    assert smooth.of(np.ones((5, 6)), PERIOD) == pytest.approx(np.ones((5, 6)))
    tone = smooth.response(np.array([10.0]), PERIOD)[0]
    assert abs(tone) == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize(
    ("name", "said"),
    [("heave", "axis and a size"), ("have-10mm", "heave"), ("pitch-10mm", "in deg"), ("heave-0mm", "a step of 0")],
)
def test_names_of_steps(name, said):
    with pytest.raises(InputError, match=said):
        AxisStep.named(name)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("modes = [6]", "modes = [5]", "needs one law"),
        ("modes = [6]", "modes = [7]", "needs one law"),
        ('rig = "hexapod"', 'rig = "jack-10t"', "no bundled platform"),
        ("low_hz = 0.5", "low_hz = 700", "high_hz"),
        ('"heave-100mm"', '"heave-100deg"', "in mm"),
        ("amplitude =", "amplitud =", "unknown key"),
        ("frequencies_hz = [1, 5]", "frequencies_hz = [1, 90]", "between 0.1 and 50"),
        ('{mass = "5 t", Ixx', '{mas = "5 t", Ixx', "unknown key"),
        ('road = "C"', 'road = "K"', "record.road"),
        ("band_hz = [0.5, 12]", "band_hz = [12, 5]", "two frequencies"),
        ("highest_hz = 30", "highest_hz = 3000", "highest_hz"),
    ],
)
def test_experiments_are_read_strictly(tmp_path, old, new, said):
    path = tmp_path / "own.toml"
    path.write_text(EXPERIMENT.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=said):
        load_config(path)


def test_laws_of_another_signal_are_refused(setup):
    class Force:
        measures = ("force",)

    with pytest.raises(InputError, match="must control one signal"):
        PlatformController([*(law.build(PERIOD) for law in P_DP.laws[:5]), cast(Any, Force())], np.eye(6))


def test_the_command_leaves_modes_rows_and_a_page(tmp_path):
    text = re.sub(r"scenarios = .*", 'scenarios = ["surge-10mm"]', EXPERIMENT.read_text())
    path = tmp_path / "own.toml"
    text = re.sub(r"\"(mass-25|off centre|higher)\" = .*", "", text)
    text = text.replace("iterations = 4", "iterations = 1").replace('"4 s"', '"1 s"')
    path.write_text(text.replace("frequencies_hz = [1, 5]", "frequencies_hz = [5]"))
    outcome = run_any(load_config(path), no_checkpoint, lambda what: None)
    metrics = json.loads(json.dumps(outcome.metrics))
    assert [set(mode) for mode in metrics["modes"]] == [{"hz", "zeta", "shape"}] * 6
    assert [row["controller"] for row in metrics["rows"]] == ["p-dp", "modal"]
    assert set(metrics["rows"][0]["cross"]) == set(AXES) - {"surge"}
    assert len(metrics["sines"]) == 12
    assert [row["variation"] for row in metrics["envelope"]] == ["mass+25"] * 2
    assert [len(row["rms_m"]) for row in metrics["record"]] == [2, 2]
    from workbench.report import render

    page = render(outcome.page)
    assert page.count('class="item scene"') == 2
    assert "<svg viewBox" in page
    assert load_platform("hexapod").name in outcome.page.title
