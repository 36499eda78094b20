"""Retuning: old and retuned on the declared and the found rig, from experiments of tune, run and bench."""

import json
from functools import cache
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.commands.common.outcome import Outcome, no_checkpoint
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.retune.config import load_retune
from workbench.commands.retune.study import run_retune
from workbench.report import render
from workbench.rigs.rig_file import load_rig

FOUND = str(Path(__file__).parent / "festo_found.toml")
EXPERIMENTS = Path(__file__).parents[1] / "experiments"
TUNE_P = EXPERIMENTS / "tune_festo_p.toml"
STEP = """experiment = "step"
rig = "festo-tp511"
scenarios = ["small", "position-sine-1hz"]
[scenario.small]
size = {value = 20, unit = "mm"}
seconds = {value = 2, unit = "s"}
[controllers.pid]
use = "controllers.pid_lead:PidLead"
gain = {value = 10, unit = "1/m"}
integral_time = {value = 20, unit = "s"}
lead_time = {value = 2, unit = "ms"}
lead_ratio = {value = 1.5, unit = "1"}
[controllers.p]
use = "controllers.p:P"
gain = {value = 10, unit = "1/m"}
[[controllers.p.compensators]]
use = "controllers.feedforward:FeedForward"
velocity = {value = 0, unit = "s/m"}
corner = {value = 10, unit = "Hz"}
[bode]
low_hz = 0.5
high_hz = 30
points = 4
amplitudes_mm = [5]
"""


@cache
def retuned() -> Outcome:
    return run_retune(load_retune(TUNE_P, FOUND, designs=13), no_checkpoint, lambda _: None)


def test_the_metrics_are_what_the_contract_says():
    metrics = retuned().metrics
    pairs = [(row["controller"], row["rig"]) for row in metrics["rows"]]
    assert pairs == [(what, where) for what in ("old", "retuned") for where in ("declared", "found")]
    assert {"scenario", "settling_s", "ms", "gain_margin_db", "iae", "tripped", "margins"} <= metrics["rows"][0].keys()
    before, after = (row for row in metrics["rows"] if row["rig"] == "found")
    for key, change in metrics["gain"].items():
        assert change == [before[key], after[key]]
    assert {"settling_s", "ms", "gain_margin_db", "steady_state_error"} <= metrics["gain"].keys()


def test_a_loop_that_knows_the_rig_settles_sooner_inside_the_margins():
    metrics = retuned().metrics
    before, after = metrics["gain"]["settling_s"]
    assert after < 0.7 * before
    assert metrics["missed"] == {"old": None, "retuned": None}
    assert metrics["gain"]["ms"][1] < 2.0
    assert metrics["numbers"]["gain"]["retuned"] > metrics["numbers"]["gain"]["old"] == 10.0


def test_the_page_has_one_table_and_the_steps_and_says_what_margins_leave_out():
    page = render(retuned().page)
    for words in ("settling", "instead of", "Old and retuned on both rigs", "without jack.friction", "retuned, found"):
        assert words in page


def test_it_leaves_an_experiment_on_the_rig_as_found(tmp_path):
    for name, text in retuned().files.items():
        (tmp_path / name).write_text(text)
    tuned = load_steps(tmp_path / "tuned.toml")
    assert [use.name for use in tuned.rig.effects] == [use.name for use in load_rig(FOUND).effects]
    assert tuned.controllers[0].design.gain == retuned().metrics["numbers"]["gain"]["retuned"]


def test_a_run_experiment_is_searched_within_a_factor_of_its_numbers(tmp_path):
    (tmp_path / "steps.toml").write_text(STEP)
    config = load_retune(tmp_path / "steps.toml", FOUND, controller="pid").found
    ranges = {number.name: (number.low, number.high, number.start) for number in config.searched}
    assert ranges["gain"] == pytest.approx((10 / 3, 30, 10))
    assert ranges["lead_ratio"] == pytest.approx((1.0, 4.5, 1.5))  # the class has 1 as its least
    assert [scenario.name for scenario in config.start.scenarios] == ["small"]
    assert config.limits.seconds == 2.0
    with_parts = load_retune(tmp_path / "steps.toml", FOUND, controller="p").found
    assert [number.name for number in with_parts.searched] == ["gain", "compensators.1.corner"]


def test_a_bench_experiment_keeps_its_variations_and_borrowed_controllers(tmp_path):
    (tmp_path / "steps.toml").write_text(STEP)
    (tmp_path / "bench.toml").write_text(
        'experiment = "bench"\nrig = "festo-tp511"\nscenarios = ["small"]\n'
        f'rigs = ["nominal", "mass+50", "slow", "{FOUND}"]\n[variation.slow]\nfactors = {{Ps = 0.9}}\n'
        '[scenario.small]\nsize = {value = 20, unit = "mm"}\nseconds = {value = 2, unit = "s"}\n'
        '[from]\n"steps.toml" = ["p"]\n'
        "[bode]\nlow_hz = 1\nhigh_hz = 20\npoints = 3\namplitudes_percent = [2]\n"
    )
    config = load_retune(tmp_path / "bench.toml", FOUND)
    assert list(config.found.rigs) == ["nominal", "mass+50", "slow"]
    assert config.found.rigs["slow"]["Ps"] == pytest.approx(0.9 * load_rig(FOUND)["Ps"])
    assert config.found.start.bode.amplitudes == pytest.approx([0.02 * 97e-3])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([str(TUNE_P)], "--found"),
        ([str(TUNE_P), "--found", "nowhere.toml"], "nowhere.toml: no such file"),
        ([str(TUNE_P), "--found", FOUND, "--designs", "0"], "--designs 0: must be 1 or more"),
        ([str(TUNE_P), "--found", FOUND, "--controller", "q"], 'no controller "q"'),
        ([str(EXPERIMENTS / "tune_p_dp.toml"), "--found", FOUND], "asks for a load of 20 kN, the limit of festo"),
        ([str(EXPERIMENTS / "position_tuned.toml"), "--found", FOUND], "choose one: --controller p | p-dp"),
        ([str(EXPERIMENTS / "paper.toml"), "--found", FOUND], "has no loops"),
    ],
)
def test_what_cannot_be_retuned_is_refused_in_one_line(tmp_path, capsys, words, said):
    assert main(["retune", *words, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert not list(tmp_path.iterdir())


def test_the_command_leaves_a_run_folder(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["retune", str(TUNE_P), "--found", FOUND, "--designs", "2", "--jobs", "1", "--out", str(out)]) == 0
    assert len(json.loads((out / "metrics.json").read_text())["rows"]) == 4
    assert {"report.html", "tuned.toml", "rig.toml"} <= {path.name for path in out.iterdir()}
    assert "instead of" in capsys.readouterr().out
