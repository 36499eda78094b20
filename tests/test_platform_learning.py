"""Drive files of a platform: the 6 x 6 response as measured, what it promises, and what is learned by it."""

from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.learn.options import PlatformLearnConfig, load_any
from workbench.commands.learn.platform import run_platform_learning
from workbench.commands.run.options import load_config
from workbench.commands.run.platform_config import PlatformConfig
from workbench.loop.learning import BOUND, Iteration, from_spectrum, record_frequencies, rms, spectrum
from workbench.loop.platform import platform_setup
from workbench.loop.platform.learning import (
    Left,
    RepeatedMotion,
    inverted,
    learn_motion,
    matrix_filter,
    measured_left,
    other_left,
)
from workbench.loop.platform.measured import (
    REALIZATIONS,
    MatrixResponse,
    averaged,
    matrix_response,
    measured_response,
    orthogonal_sines,
)
from workbench.loop.platform.poses import accelerated_pose, lowest_corner
from workbench.loop.platform.reach import check_poses
from workbench.records.excitation import MultisineSpec
from workbench.rigs.platform import AXES, load_platform

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
PLATFORM = load_platform("hexapod")
PERIOD, ROWS = 1e-3, 4000
ORDER = np.unique(np.geomspace(2, 160, 50).astype(int))
F = ORDER / (ROWS * PERIOD)


def loops(f, corner=8.0, coupling=0.3, seed=0):
    """Six closed loops of second order that are coupled, [k, 6, 6]."""
    mixing = np.eye(6) + coupling * np.random.default_rng(seed).uniform(-1, 1, (6, 6))
    s = 1j * f / corner
    return (1 / (1 + s + s**2))[:, None, None] * np.eye(6) + (s / (1 + s) ** 3)[:, None, None] * (mixing - np.eye(6))


def answered(waves, noise=0.0, seed: tuple[int, ...] = (0,)):
    """What such loops answer to whole periods [6, rows, 6]."""
    lines = np.fft.rfft(waves, axis=1)
    lines[:, ORDER] = np.einsum("kij,mkj->mki", loops(F), lines[:, ORDER])
    clean = np.fft.irfft(lines, ROWS, axis=1)
    return clean + noise * np.random.default_rng(seed).standard_normal(clean.shape)


def estimated(noise, seed=0):
    waves = [orthogonal_sines(ORDER, ROWS, i) for i in range(REALIZATIONS)]
    parts = [matrix_response(w, answered(w, noise, (seed, i)), ORDER) for i, w in enumerate(waves)]
    return averaged(F, np.array(parts))


def test_six_experiments_solve_for_every_entry():
    assert estimated(0.0).response == pytest.approx(loops(F), abs=1e-9)
    waves = orthogonal_sines(ORDER, ROWS, 0)
    assert np.abs(waves).max() == pytest.approx(1.0)
    u = np.moveaxis(np.fft.rfft(waves, axis=1)[:, ORDER], 0, -1)
    assert np.linalg.cond(u) == pytest.approx(np.ones(len(ORDER)))


def test_the_deviation_of_an_entry_is_that_of_its_errors():
    one = estimated(0.02)
    errors = np.array([estimated(0.02, seed).response - loops(F) for seed in range(1, 9)])
    share = np.sqrt(np.mean(np.abs(errors) ** 2, axis=0) / one.deviation**2)
    assert np.median(share) == pytest.approx(1.0, abs=0.15)
    drawn = np.array(list(one.drawn(200)))
    assert np.mean(np.abs(drawn - one.response) ** 2, axis=0) == pytest.approx(one.deviation**2, rel=0.5)


def test_between_the_lines_a_response_is_interpolated():
    at = estimated(0.0).at(np.array([0.0, F[3], 0.5 * (F[20] + F[21])]))
    assert np.abs(at.response[0].imag).max() == 0.0
    assert at.response[1] == pytest.approx(loops(F)[3], abs=1e-9)
    assert at.response[2] == pytest.approx(loops(np.array([0.5 * (F[20] + F[21])]))[0], abs=0.02)


def linear_plant(f, samples, response):
    """Plays drives [samples, 6] on linear loops [k, 6, 6]."""

    def play(number, drive, gain):
        lines = np.einsum("kij,jk->ik", response, spectrum(drive.T, len(f)))
        true = from_spectrum(lines, samples).T
        return Iteration(drive, true, true, np.zeros_like(drive), 0.0, {}, None, gain)

    return play


def test_the_error_shrinks_by_what_the_matrices_promise():
    """Coupled loops, learned by the response of others: no slower than the largest singular value says, beforehand."""
    samples = 3000
    f, measured = record_frequencies(samples, PERIOD), estimated(0.005)
    left = [measured_left(measured), Left.of(inverted(measured.response), loops(F, 7.0))]
    t = np.arange(samples) * PERIOD
    reference = np.outer(np.sin(np.pi * t / 3) ** 2 * np.sin(2 * np.pi * 5 * t), np.eye(6)[0]) * 0.01
    learning = matrix_filter(reference, PERIOD, measured, left)
    q = 1 / (1 + (F / learning.cutoff) ** 8)
    assert max((q * each.norm).max() for each in left) < BOUND
    assert all(np.all(each.radius <= each.norm + 1e-12) for each in left)
    learned = learn_motion(learning, reference, linear_plant(f, samples, loops(f, 7.0)), 6)
    errors = [learned.error(iteration) for iteration in learned.iterations]
    there = left[1].norm[np.argmin(np.abs(F - 5.0))]
    assert errors[1] < 1.2 * there * errors[0]
    assert learned.fall_db > 20
    assert np.abs(learned.best.drive[:, 1:]).max() > 0.02 * np.abs(learned.best.drive[:, 0]).max()


def test_a_loop_that_turns_an_axis_round_has_no_cut_off():
    measured = MatrixResponse(F, loops(F), np.zeros((len(F), 6, 6)))
    turned = loops(F) @ np.diag([1, 1, 1, 1, 1, -1.0])
    left = other_left(measured, loops(F), turned)
    assert left.radius[0] == pytest.approx(2.0, abs=0.1)
    t = np.arange(3000) * PERIOD
    reference = np.outer(np.sin(np.pi * t / 3) ** 2 * np.sin(2 * np.pi * 5 * t), np.ones(6))
    assert matrix_filter(reference, PERIOD, measured, [left]).cutoff < F[0]
    straight = Left.of(inverted(measured.response), measured.response)
    assert 5.0 < matrix_filter(reference, PERIOD, measured, [straight]).cutoff < 10.0


def test_accelerations_are_integrated_above_a_corner():
    """Twice differentiated, a sine well above the corner is what was asked for; all begins and ends at home."""
    t = np.arange(0, 6.0001, 0.01)
    values = np.outer(np.sin(np.pi * t / 6) ** 2 * np.sin(2 * np.pi * 4 * t), [2.0, 0, 1.0, 0, 0.5, 0])
    pose = accelerated_pose(PLATFORM, t, values, 0.5)
    assert np.abs(pose[[0, -1]]).max() == 0.0
    again = np.gradient(np.gradient(pose, PERIOD, axis=0), PERIOD, axis=0)
    first = round((0.5 + 1.5 / 0.5) / PERIOD)
    inside = again[first : first + 6001 : 10]
    assert inside[5:-5] == pytest.approx(values[5:-5], abs=0.03)


def test_the_stroke_says_above_which_frequency_accelerations_are_kept():
    t = np.arange(0, 4.0001, 0.01)
    step = np.outer(np.where(t < 2, 1.0, -1.0), np.eye(6)[2])
    gentle, strong = (lowest_corner(PLATFORM, t, size * step) for size in (0.5, 3.0))
    assert gentle < strong
    stroke = check_poses(PLATFORM, accelerated_pose(PLATFORM, t, 3.0 * step, strong)).stroke.max()
    lower = check_poses(PLATFORM, accelerated_pose(PLATFORM, t, 3.0 * step, 0.9 * strong)).stroke.max()
    assert stroke < 0.95 < lower
    with pytest.raises(InputError, match="take more than the stroke"):
        lowest_corner(PLATFORM, t, 1e4 * step)


def config_of(folder, *changes, text=None):
    text = text or (EXPERIMENTS / "learn_platform.toml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "own.toml").write_text(text)
    if not (folder / "quake.csv").exists():
        (folder / "quake.csv").write_text((EXPERIMENTS / "quake.csv").read_text())
    return load_any(folder / "own.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("plants = 5", "", "say how many under `plants`"),
        ("mass = [0.75, 1.25]", "mass = [1.25, 0.75]", "least and the largest"),
        ('amplitude = {value = 10, unit = "mm"}', "", "amplitude"),
        ("lines = 40", "lines = 40\nlanes = 3", "unknown key"),
        ("highpass_hz = 0.5", "highpass_hz = 0", "highpass_hz"),
        ('file = "quake.csv"', 'file = "quake.csv"\niterations = 3', "unknown key"),
        (
            "[controllers.p-dp]",
            '[controllers.q]\nuse = "controllers.p:P"\ngain = "3 1/m"\n[controllers.p-dp]',
            "name one",
        ),
    ],
)
def test_experiments_are_read_strictly(tmp_path, old, new, said):
    with pytest.raises(InputError, match=said):
        config_of(tmp_path, (old, new))


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("t [s],surge [m/s^2],sway [mm],heave [mm]", "all of one kind"),
        ("t [s],surge [mm],sway [mm],heave [mm]", "remove it"),
    ],
)
def test_poses_and_accelerations_are_not_mixed(tmp_path, head, said):
    rows = (EXPERIMENTS / "quake.csv").read_text().splitlines()
    (tmp_path / "quake.csv").write_text("\n".join([head, *rows[1:]]) + "\n")
    with pytest.raises(InputError, match=said):
        config_of(tmp_path)


def test_what_trips_says_the_amplitude(tmp_path, capsys):
    text = (EXPERIMENTS / "learn_platform.toml").read_text().replace("value = 10,", "value = 400,")
    config_of(tmp_path, ("plants = 5", "plants = 1"), text=text)
    assert main(["learn", str(tmp_path / "own.toml"), "--out", str(tmp_path / "out")]) == 2
    assert "[measure] amplitude: " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def learning(tmp_path_factory):
    """A short road in pitch and another payload, measured with few lines. The error of 10 mm would be 18 dB above what
    the sensors' noise leaves."""
    folder = tmp_path_factory.mktemp("learn")
    road = 'axis = "pitch"\nroad = "C"\nspeed = "15 m/s"\nseconds = "2 s"\nband_hz = [0.5, 8]\npeak = "30 mm"'
    config = config_of(
        folder,
        ('highpass_hz = 0.5\nfile = "quake.csv"', road),
        ("plants = 5", "plants = 1"),
        ("iterations = 6", "iterations = 4"),
        ("seconds = {value = 2", "seconds = {value = 1"),
        ("low = {value = 0.5", "low = {value = 1"),
        ("lines = 40", "lines = 20"),
    )
    assert isinstance(config, PlatformLearnConfig)
    return run_platform_learning(config, no_checkpoint, lambda _: None)


def test_a_road_is_learned_with_noise_on_a_drawn_payload(learning):
    declared, drawn = learning.metrics["learned"]
    assert declared["fall_db"] > 20
    assert drawn["fall_db"] > 20
    assert all(row["radius"] <= row["norm"] < BOUND for row in learning.metrics["convergence"])
    assert learning.metrics["plants"][0]["fallen"] == 1
    first, *_, last = [row["true_error_rms"] for row in learning.metrics["rows"] if row["rig"] == "declared"]
    assert last < 0.15 * first
    assert learning.metrics["payloads"][0]["mass"] != PLATFORM["mass"]


def test_the_drive_file_is_a_record_that_a_platform_s_experiment_plays(learning, tmp_path):
    (tmp_path / "drive.csv").write_text(learning.files["drive-declared.csv"])
    text = (EXPERIMENTS / "hexapod.toml").read_text()
    road = text[text.index("[record]") : text.index("iterations")]
    (tmp_path / "own.toml").write_text(text.replace(road, '[record]\nfile = "drive.csv"\n'))
    config = load_config(tmp_path / "own.toml")
    assert isinstance(config, PlatformConfig)
    assert config.record is not None
    last = max(row["iteration"] for row in learning.metrics["rows"] if row["rig"] == "declared" and row["kept"])
    asked = np.column_stack([learning.tables[f"declared-{last}"][f"drive.{axis}"] for axis in AXES])
    played = config.record.pose[500 : 500 + len(asked)]
    assert rms(played - asked) < 0.05 * rms(asked)


def test_a_small_motion_is_answered_as_the_linear_loop_says():
    """Without noise, well below the lap of the lands: the measured response is that of the linearised platform."""
    config = load_any(EXPERIMENTS / "learn_platform.toml")
    assert isinstance(config, PlatformLearnConfig)
    setup = platform_setup(config.rig, config.delay)
    player = RepeatedMotion.of(config.controller, setup, None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("workbench.loop.platform.measured.REALIZATIONS", 2)
        measured = measured_response(setup, player.controller, MultisineSpec(1e-4, (2.0, 30.0), 1.0, 8), None)
    linear = player.transfer(measured.f)
    assert linear is not None
    assert np.abs(measured.response - linear).max() < 0.05
    assert rms(measured.deviation) < 0.02
