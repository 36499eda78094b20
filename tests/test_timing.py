"""Computing times: measured, written into an experiment, and what a loop with such a delay does."""

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.bench import study as study
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.step_experiment import StepConfig
from workbench.commands.run.options import load_config
from workbench.loop.rig_variations import with_delay
from workbench.loop.rows import linear_loops, loop_setup
from workbench.loop.run_numbers import summary
from workbench.plant import build
from workbench.rigs.rig import EffectUse

STEP = """
experiment = "step"
rig = "jack-10t"
scenarios = ["position-10mm"]
[controllers.p]
use = "controllers.p:P"
gain = {value = 0.24, unit = "1/m"}
[controllers.lqg]
use = "controllers.lqg:Lqg"
velocity_gain = {value = 7.3198, unit = "m/s"}
jack_frequency = {value = 27.453, unit = "Hz"}
jack_damping = {value = 0.054095, unit = "1"}
valve_frequency = {value = 115.32, unit = "Hz"}
valve_damping = {value = 0.55505, unit = "1"}
delay = {value = 0.00092978, unit = "s"}
error = {value = 80, unit = "mm"}
[bode]
low_hz = 5
high_hz = 20
points = 3
amplitudes_mm = [1]
"""


@pytest.fixture(scope="module")
def timed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("time")
    (folder / "step.toml").write_text(STEP)
    assert main(["time", str(folder / "step.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out"


def test_the_experiment_that_is_left_has_the_delay_of_each_controller(timed):
    timing = json.loads((timed / "metrics.json").read_text())["timing"]
    config = load_config(timed / "timed.toml")
    assert isinstance(config, StepConfig)
    for chosen in config.controllers:
        assert chosen.computing_delay == pytest.approx(timing[chosen.name]["solve_p99_us"] * 1e-6, abs=1e-7)
        assert 0 < timing[chosen.name]["solve_p50_us"] <= timing[chosen.name]["solve_p99_us"]


def test_late_samples_are_counted():
    assert summary(np.array([10.0, 20.0, 1500.0]), 1e-3)["late"] == 1


def test_a_computing_delay_comes_on_top_of_the_drive_s(rig):
    once = with_delay(rig, 3e-4)
    assert build(rig).lateness() == 0
    assert build(once).lateness() == pytest.approx(3e-4)
    assert build(with_delay(once, 2e-3)).lateness() == pytest.approx(2.3e-3)
    typical = replace(rig, effects=(EffectUse("drive.delay", "", {}),))
    assert build(with_delay(typical, 1e-3)).lateness() == pytest.approx(build(typical).lateness() + 1e-3)
    assert build(typical).lateness() > 0


def test_a_bench_plays_with_the_delay_of_the_controller_or_the_rig_s(tmp_path):
    controllers = STEP[STEP.index("[controllers.p]") : STEP.index("[controllers.lqg]")]
    late = controllers.replace("controllers.p]", "controllers.late]") + 'computing_delay = {value = 5, unit = "ms"}\n'
    head = 'experiment = "bench"\nrig = "jack-10t"\nrigs = ["nominal"]\nscenarios = ["position-10mm"]\n'
    (tmp_path / "late.toml").write_text(
        head + controllers + late + "[bode]\nlow_hz = 5\nhigh_hz = 10\npoints = 3\namplitudes_percent = [1]\n"
    )
    config = BenchConfig.load(tmp_path / "late.toml")
    metrics = study.run_bench(config, no_checkpoint, lambda _: None).metrics
    for row, spec, delay in zip(metrics["rows"], config.loops[0].controllers, (0.3e-3, 5e-3), strict=True):
        setup = loop_setup(with_delay(config.rig, delay))
        assert row["ms"] == linear_loops(spec, setup).worst(max, "ms")
    assert metrics["fallbacks"] == []


def test_a_run_on_a_recorded_course_is_known_by_its_file(tmp_path):
    """What has been computed is not taken up again where the course is another one by now."""
    course = Path(__file__).parents[1] / "docs" / "files" / "course.csv"
    own = f'scenarios = ["course"]\n[scenario.course]\nfile = "{course}"\nslow = true\nseconds = "1 s"\n'
    head, _, rest = STEP.partition('scenarios = ["position-10mm"]\n')
    (tmp_path / "step.toml").write_text(
        head + own + rest.replace(rest[rest.index("[controllers.lqg") : rest.index("[bode")], "")
    )
    assert main(["time", str(tmp_path / "step.toml"), "--out", str(tmp_path / "out")]) == 0
    assert sha256(course.read_bytes()).hexdigest() in (tmp_path / "out" / "config.toml").read_text()


def test_an_experiment_without_controllers_is_refused(capsys):
    paper = Path(__file__).parents[1] / "experiments" / "paper.toml"
    assert main(["time", str(paper)]) == 2
    assert '"paper" is not "step" or "bench"; jackbench run takes it' in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["tune", "bench"])
def test_run_points_to_the_command_that_takes_an_experiment(tmp_path, kind):
    (tmp_path / "other.toml").write_text(f'experiment = "{kind}"\n')
    with pytest.raises(InputError, match=f"jackbench {kind} takes it"):
        load_config(tmp_path / "other.toml")
