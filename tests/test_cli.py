"""The command line as a person meets it: real processes, exit statuses, one line for bad input (files in this one)."""

import json
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from importlib.metadata import entry_points
from io import StringIO
from pathlib import Path

import pytest

import controllers
import envs
import workbench
from workbench.cli import main

ROOT = Path(__file__).parents[1]
RIG = ROOT / "workbench" / "rigs" / "jack-10t.toml"
FAST = 'experiment = "paper"\nrig = "jack-10t"\npoints = 5\n'


def jackbench(*words: object, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "workbench.cli", *map(str, words)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120, check=False)


def in_this_process(*words: object, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """As `jackbench`, without the half second that a process takes to start."""
    said, told = StringIO(), StringIO()
    with chdir(cwd), redirect_stdout(said), redirect_stderr(told):
        try:
            status = main([*map(str, words)])
        except SystemExit as ended:
            status = ended.code
    return subprocess.CompletedProcess(words, status, said.getvalue(), told.getvalue())


def test_the_packages_are_ours():
    """Two of the names also exist on the public index."""
    for package in (workbench, controllers, envs):
        assert Path(package.__file__).is_relative_to(ROOT)


def test_the_command_is_installed():
    (command,) = entry_points(group="console_scripts", name="jackbench")
    assert command.load() is not None


def test_a_run_leaves_what_the_contract_says(tmp_path):
    (tmp_path / "fast.toml").write_text(FAST)
    out, picture = tmp_path / "made", tmp_path / "picture.svg"
    done = jackbench("run", tmp_path / "fast.toml", "--out", out, "--picture", picture)
    assert done.returncode == 0, done.stderr
    assert str(out / "report.html") in done.stdout
    assert picture.stat().st_size > 1000
    assert not out.with_name("made.partial").exists()
    names = {path.name for path in out.iterdir()}
    assert {"metrics.json", "report.html", "config.toml", "main_100.parquet"} <= names
    assert len(json.loads((out / "metrics.json").read_text())["rows"]) == 8

    again = in_this_process("run", tmp_path / "fast.toml", "--out", tmp_path / "again")
    assert again.returncode == 0
    assert (tmp_path / "again" / "metrics.json").read_bytes() == (out / "metrics.json").read_bytes()

    refused = in_this_process("run", tmp_path / "fast.toml", "--out", out)
    assert refused.returncode == 2
    assert "--force" in refused.stderr


def edited(tmp_path: Path, start: str, row: str) -> Path:
    """The 10 t rig with the row that begins with `start` replaced."""
    rows = [row if text.startswith(start) else text for text in RIG.read_text().splitlines()]
    path = tmp_path / "rig.toml"
    path.write_text("\n".join(rows))
    return path


@pytest.mark.parametrize(
    ("start", "row", "words"),
    [
        ("beta =", 'beta = {value = nan, unit = "Pa"}', ["line 10", "oil.beta", "must be a finite number"]),
        ("beta =", 'beta = {value = 1e9, unit = "kg"}', ["line 10", "oil.beta", "converted"]),
        ("beta =", 'bta = {value = 1e9, unit = "Pa"}', ["line 10", 'did you mean "beta"']),
        ("beta =", "", ["oil.beta: missing", "bulk modulus"]),
        ("M =", 'M = {value = -5, unit = "kg"}', ["load.M", "outside"]),
        ("l =", 'l = {value = 1, unit = "m"}', ["line 16", "valve.l: 1 m is outside 0.001 to 0.05 m"]),
        ("M =", "M = {value = , }", ["line 67", "mend the TOML"]),
        ('kind = "double', 'kind = "double"', ["jack.kind", 'did you mean "double-rod"']),
    ],
)
def test_a_bad_rig_is_refused_in_one_line(tmp_path, start, row, words):
    out = tmp_path / "out"
    done = in_this_process("run", "experiments/paper.toml", "--rig", edited(tmp_path, start, row), "--out", out)
    assert_refused(done, words)
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["experiment: missing"]),
        ('experiment = "papr"', ['did you mean "paper"']),
        ('experiment = "paper"\nrig = "jack-10"\npoints = 9', ['did you mean "jack-10t"']),
        (FAST + "point = 3", ["point: unknown key", 'did you mean "points"']),
        (FAST.replace("5", "-5"), ["points", "whole number"]),
        ('experiment = "step"\nrig = "jack-10t"\nscenarios = ["position-10mm"]', ["no controllers"]),
    ],
)
def test_a_bad_experiment_is_refused_in_one_line(tmp_path, text, words):
    (tmp_path / "bad.toml").write_text(text)
    assert_refused(in_this_process("run", "bad.toml", "--out", "out", cwd=tmp_path), words)
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "nothere.toml"], ["nothere.toml", "no such file"]),
        (["run", "."], ["is a folder"]),
        (["run"], ["experiment", "--help"]),
        (["fly"], ["fly", "residual"]),
        (["trace-study", "--number", "20"], ["python -m experiments.studies.trace"]),
        (["tune", "tune_p", "--tries", "6"], ["--tries 6", "see jackbench tune --help"]),
        (["residual", "nothere"], ["no such file"]),
        (["trace", "nothere"], ["no such file"]),
        (["fit", "experiments/sample", "--starts", "two"], ["--starts", "--help"]),
        (["trace", "experiments/sample", "--rig", "jack10t"], ['did you mean "jack-10t"']),
        (["run", "experiments/paper.toml", "--picture", "x.pdf"], [".png"]),
        (["run", "experiments/paper.toml", "--rig", "festo-tp511"], ["three-stage"]),
        (["run", "experiments/paper.toml", "--rig", "jack10t"], ['did you mean "jack-10t"']),
    ],
)
def test_bad_arguments_are_refused_in_one_line(arguments, words):
    run = jackbench if arguments == ["fly"] else in_this_process
    assert_refused(run(*arguments, cwd=ROOT), words)


def test_a_campaign_s_bad_cell_is_named_by_file_column_and_row(tmp_path):
    rows = ["t [s],command [1],pa [bar],position [mm]", *(f"{k * 1e-3},0,10,{k % 2}" for k in range(200))]
    rows[57] = "0.056,0,broken,0"
    (tmp_path / "a.csv").write_text("\n".join(rows))
    (tmp_path / "campaign.toml").write_text('rig = "jack-10t"\n[records]\nheldout = ["a.csv"]\n')
    assert_refused(in_this_process("residual", tmp_path), ["a.csv", "58", "pa"])


def assert_refused(done: subprocess.CompletedProcess[str], words: list[str]) -> None:
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
    for word in words:
        assert word in done.stderr
    assert "Traceback" not in done.stderr
