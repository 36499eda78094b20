"""Scenarios of an experiment's own: what its tables say, and what is refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.step_experiment import load_steps
from workbench.loop.reach import check_flow
from workbench.loop.rig_variations import variation
from workbench.loop.rows import judge, linear_loops, loop_setup, play
from workbench.loop.scenarios import Scenario
from workbench.rigs.rig_file import load_rig

HEAD = """
experiment = "step"
rig = "jack-10t"
scenarios = ["position-10mm", "own"]
[controllers.p]
use = "controllers.p:P"
gain = "0.24 1/m"
[bode]
low_hz = 5
high_hz = 20
points = 3
amplitudes_mm = [1]
[scenario.own]
"""
WAVE = "t [ms],position [cm]\n0,10\n100,10.1\n300,9.9\n"


def own(folder, text):
    """The scenario of a table."""
    (folder / "wave.csv").write_text(WAVE)
    (folder / "steps.toml").write_text(HEAD + text)
    return load_steps(folder / "steps.toml").scenarios[1]


def test_a_step_from_a_share_of_the_stroke(tmp_path):
    step = own(tmp_path, 'size = "-5 mm"\nstart = 0.5\nseconds = "1 s"')
    assert (step.size, step.duration, step.arrives) == (-5e-3, 1.0, 0.0)
    assert step.position(0.24) == pytest.approx(0.12)


def test_a_ramp_from_a_position(tmp_path):
    ramp = own(tmp_path, 'size = "-10 mm"\nrate = "20 mm/s"\nstart = "-30 mm"\nseconds = {value = 2, unit = "s"}')
    assert ramp.reference(np.array([0.0, 0.25, 1.0])) == pytest.approx([0, -5e-3, -10e-3])
    assert ramp.arrives == 0.5
    assert ramp.position(0.24) == pytest.approx(-0.03)


def test_a_sine(tmp_path):
    sine = own(tmp_path, 'size = "2 mm"\nfrequency = "5 Hz"\nseconds = "1 s"')
    assert sine.reference(np.array([0.05])) == pytest.approx([2e-3])
    assert sine.arrives is None


def test_a_waveform_of_a_file_beside_the_experiment_in_its_own_units_from_its_first_row(tmp_path):
    wave = own(tmp_path, 'file = "wave.csv"')
    assert wave.duration == pytest.approx(0.3)
    assert wave.reference(np.array([0.0, 0.05, 0.2, 0.3])) == pytest.approx([0, 5e-4, 0, -1e-3])


def test_a_file_that_is_sampled_faster_goes_through_a_low_pass_and_the_report_says_what_is_gone(tmp_path):
    t = np.arange(5001) * 2e-4
    values = np.sin(2 * np.pi * 3 * t) + 0.2 * np.sin(2 * np.pi * 900 * t)
    rows = "\n".join(f"{a:.6f},{b:.9f}" for a, b in zip(t, values, strict=True))
    (tmp_path / "fast.csv").write_text(f"t [s],position [mm]\n{rows}\n")
    fast = own(tmp_path, 'file = "fast.csv"')
    at = np.arange(1001) * 1e-3
    assert fast.reference(at) == pytest.approx(1e-3 * np.sin(2 * np.pi * 3 * at), abs=1e-6)
    assert fast.left_out == pytest.approx(0.04 / 1.04, rel=0.01)
    assert fast.remarks == [
        "own is without 3.85 % of its energy, above half the control rate: a low pass takes that out."
    ]


def test_a_record_beyond_the_rig_is_refused_by_how_much_or_slowed(tmp_path):
    t = np.arange(1001) * 1e-3
    rows = "\n".join(f"{a:.6f},{b:.9f}" for a, b in zip(t, 20 * np.sin(2 * np.pi * 20 * t), strict=True))
    (tmp_path / "quick.csv").write_text(f"t [s],position [mm]\n{rows}\n")
    with pytest.raises(InputError, match="it is too fast by a factor of 1"):
        own(tmp_path, 'file = "quick.csv"')
    slow = own(tmp_path, 'file = "quick.csv"\nslow = true')
    assert slow.slowed == pytest.approx(1.815, abs=0.02)
    assert slow.duration == pytest.approx(slow.slowed, abs=1e-3)
    assert slow.remarks[0].startswith("own is slowed by a factor of 1.8")
    assert slow.remarks[0].endswith("jack-10t cannot follow it faster.")


def test_a_motion_that_any_rig_of_a_set_cannot_make_is_refused_for_the_weakest():
    rig = load_rig("jack-10t")
    rigs = [variation(rig, name) for name in ("nominal", "supply-20", "mass+50")]
    t = np.arange(201) * 1e-3
    record = Scenario(
        "own", "position", 0.02, 0.2, waveform=(tuple(t.tolist()), tuple((5e-3 * np.sin(2 * np.pi * 20 * t)).tolist()))
    )
    check_flow(record, rigs[:1])
    with pytest.raises(
        InputError, match=r"than mass\+50 has, the weakest of 3 rigs: it is too fast by a factor of 1\.1"
    ):
        check_flow(record, rigs)
    with pytest.raises(InputError, match="slowed for nominal alone; slow its file down"):
        check_flow(replace(record, slowed=1.5, slowed_for="nominal"), rigs)


def test_a_motion_from_rest_to_rest_within_what_the_rig_can_give(tmp_path):
    smooth = own(tmp_path, 'size = "-10 mm"\nprofile = "jerk-limited"\nacceleration = "40 m/s^2"')
    assert smooth.arrives == smooth.stands == pytest.approx(0.067)
    assert smooth.reference(np.array([0.0, smooth.stands, 1.0])) == pytest.approx([0, -10e-3, -10e-3])
    quick = own(tmp_path, 'size = "100 mm"\nprofile = "time-optimal"\nseconds = "0.6 s"')
    assert (quick.duration, quick.stands) == pytest.approx((0.6, 0.073))
    assert not quick.is_step
    ready = own(tmp_path, 'size = "100 mm"\nprofile = "jerk-limited"')
    assert (ready.stands, ready.is_step) == (pytest.approx(0.132), False)


def test_a_file_s_row_says_by_how_much_it_was_slowed(tmp_path):
    t = np.arange(101) * 1e-3
    rows = "\n".join(f"{a:.6f},{b:.9f}" for a, b in zip(t, 20 * np.sin(2 * np.pi * 20 * t), strict=True))
    (tmp_path / "quick.csv").write_text(f"t [s],position [mm]\n{rows}\n")
    slow = own(tmp_path, 'file = "quick.csv"\nslow = true')
    config = load_steps(tmp_path / "steps.toml")
    setup = loop_setup(config.rig)
    (spec,), loops = config.controllers, linear_loops(config.controllers[0], setup)
    assert judge(spec, slow, setup, loops)[1]["slowed"] == slow.slowed
    assert "slowed" not in judge(spec, config.scenarios[0], setup, loops)[1]


def test_a_far_end_that_moves(tmp_path):
    path = tmp_path / "force.toml"
    text = (
        HEAD.replace('"position-10mm", ', "")
        .replace("_mm", "_kn")
        .replace('"0.24 1/m"', '"3 1/m"\nstiffness = "1e7 N/m"')
    )
    specimen = '[specimen]\nstiffness = "1e7 N/m"\ndamping = "1e3 N s/m"\n'
    path.write_text(text + 'signal = "force"\ntravel = "5 mm"\nspeed = "0.1 m/s"\nseconds = "1 s"\n' + specimen)
    (scenario,) = load_steps(path).scenarios
    assert (scenario.size, scenario.travel, scenario.speed) == (0.0, 5e-3, 0.1)
    assert scenario.arrives == pytest.approx(0.57)  # it leaves at 0.5 s, and speeds up and slows down at 5 m/s2
    path.write_text(text + 'signal = "force"\ntravel = "5 mm"\nseconds = "1 s"\n' + specimen)
    with pytest.raises(InputError, match="travel: a far end moves by a travel at a speed; give both"):
        load_steps(path)


def test_a_load_pushes_a_jack_that_stands_anywhere(tmp_path):
    load = own(tmp_path, 'load = "-10 kN"\nload_at = "0.2 s"\nstart = -0.5\nseconds = "0.8 s"')
    assert load.arrives == 0.2
    config = load_steps(tmp_path / "steps.toml")
    setup = loop_setup(config.rig)
    run = play(config.controllers[0], load, setup)
    position, t = run.record.signals["position"], run.record.t
    assert position[t < 0.2] == pytest.approx(-0.12, abs=1e-6)
    assert run.record.signals["force"][-1] == pytest.approx(-10e3)
    assert position[-1] > -0.12 + 1e-4  # away from where the force on the load cell points
    assert linear_loops(config.controllers[0], setup.where(load)).null.ms is not None


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('sise = "5 mm"', 'scenario.own.sise: unknown key; did you mean "size"?'),
        ('seconds = "1 s"', "scenario.own: asks for nothing; give a size, a file, a road, a load or a travel"),
        ('size = "5 mm"', "scenario.own.seconds: missing (how long it is watched, in s)"),
        ('size = "5 kN"\nseconds = "1 s"', 'cannot be converted to "m"'),
        ('size = "0 mm"\nseconds = "1 s"', "scenario.own.size: must be there, and not 0"),
        ('load = "1 kN"\nfrequency = "1 Hz"\nseconds = "1 s"', "scenario.own.size: must be there, and not 0"),
        ('size = "5 mm"\nload_at = "1 s"\nseconds = "1 s"', "scenario.own.load_at: there is no load"),
        ('size = "5 mm"\nrate = "1 mm/s"\nfrequency = "1 Hz"\nseconds = "1 s"', "not together with rate; remove one"),
        ('size = "5 mm"\nfile = "wave.csv"', "the file has the size; remove one"),
        ('file = "waves.csv"', "waves.csv: no such file"),
        ('size = "5 mm"\nstart = 1.5\nseconds = "1 s"', "a share of the stroke limit, -1 to 1"),
        ('size = "5 mm"\nstart = "300 mm"\nseconds = "1 s"', "a position of 305 mm, the limit of jack-10t is 240 mm"),
        ('size = "30 mm"\nstart = 0.9\nseconds = "1 s"', "a position of 246 mm, the limit of jack-10t is 240 mm"),
        ('size = "200 mm"\nfrequency = "10 Hz"\nseconds = "1 s"', "a speed of 12.5664 m/s, the limit of jack-10t"),
        ('size = "1 mm"\nfrequency = "500 Hz"\nseconds = "1 s"', "500 Hz: must be below half the control rate"),
        ('load = "100 kN"\nseconds = "1 s"', "asks for a load of 100 kN, the limit of jack-10t is 90 kN"),
        ('size = "10 mm"\nrate = "10 mm/s"\nseconds = "1 s"', "too short; give at least 1.3 s"),
        ('signal = "force"\nsize = "5 kN"\nseconds = "1 s"', "are different loops; make two experiments"),
        ('size = "5 mm"\nslow = true\nseconds = "1 s"', "scenario.own.slow: needs a file; give one"),
        ('size = "5 mm"\njerk = "1 m/s^3"\nseconds = "1 s"', "scenario.own.jerk: needs a profile; give one"),
        ('size = "5 mm"\nprofile = "fast"', 'scenario.own.profile = "fast": known: jerk-limited, time-optimal'),
        ('size = "5 mm"\nprofile = "time-optimal"\njerk = "1 m/s^3"', "has no limit of jerk; remove it"),
        ('size = "5 mm"\nprofile = "jerk-limited"\nspeed = "6 m/s"', "own.speed: jack-10t has 5 m/s; ask for less"),
        ('size = "5 mm"\nprofile = "jerk-limited"\nspeed = "4 m/s"\nacceleration = "90 m/s^2"',
         "own.acceleration: jack-10t has 66.33 m/s^2 at 4 m/s; ask for less"),
        ('size = "5 mm"\nprofile = "jerk-limited"\nload = "85 kN"', "own.load: leaves jack-10t no force"),
        ('size = "5 mm"\nseconds = "1 s"\n[scenario.position-10mm]\nsize = "5 mm"\nseconds = "1 s"',
         "scenario.position-10mm: is a standard scenario; choose another name"),
        ('size = "5 mm"\nseconds = "1 s"\n[scenario.more]\nsize = "5 mm"\nseconds = "1 s"',
         "scenario.more: is not in the list `scenarios`"),
    ],
)  # fmt: skip
def test_a_scenario_that_makes_no_sense_is_refused(tmp_path, text, complaint):
    with pytest.raises(InputError) as refused:
        own(tmp_path, text)
    assert complaint in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_standard_scenario_beyond_the_rig_is_refused_too(tmp_path, capsys):
    (tmp_path / "steps.toml").write_text(HEAD.replace('"own"]', '"position-200mm"]').replace("[scenario.own]", ""))
    assert main(["run", str(tmp_path / "steps.toml"), "--rig", "festo-tp511", "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "a position of 200 mm, the limit of festo-tp511 is 97 mm; ask for less" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
