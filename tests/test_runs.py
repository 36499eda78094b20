"""The run folder: whole or resumable, never half; with processes that are really stopped where it matters."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.report import Page
from workbench.runs import Run, metrics_json, open_run, resolved_config, versions

COMMAND = {"command": "bench", "config": {"rigs": ["nominal", "mass+50"], "step": 1e-3}, "seed": 7}
PAGE = Page("Bench", "It runs.", [])
ROOT = Path(__file__).parents[1]

# Two stages; the second announces itself and waits to be stopped while a file called "wait" is beside the output.
SCRIPT = """
import sys, time
from pathlib import Path
from workbench.errors import InputError
from workbench.report import Page
from workbench.runs import open_run, resolved_config

out, wait = Path(sys.argv[1]), Path(sys.argv[1]).with_name("wait")
command = {"command": "bench", "seed": 7}

def first():
    print("first", flush=True)
    return {"a": 0.1 + 0.2}

def second():
    print("second", flush=True)
    while wait.exists():
        time.sleep(0.01)
    return [1, 2, 3]

try:
    with open_run(out, command) as run:
        print("resumed" if run.resumed else "fresh", flush=True)
        rows = [run.stage("first", first), run.stage("second", second)]
        run.finish({"rows": rows}, resolved_config(command), {}, Page("t", "v", []))
except InputError as error:
    print(error, file=sys.stderr)
    raise SystemExit(2)
"""


def start(out: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(out)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # a SIGINT that the shell ignores would be ignored here too
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


def until_second(process: subprocess.Popen[str]) -> list[str]:
    """What the process said until it works on its second stage."""
    assert process.stdout is not None
    said = []
    while not said or said[-1] != "second":
        line = process.stdout.readline()
        assert line, process.stderr and process.stderr.read()
        said.append(line.strip())
    return said


def finish(run: Run, value: object = 1.5, tables: Mapping[str, Mapping[str, np.ndarray]] | None = None) -> None:
    run.finish({"rows": [{"value": value}]}, resolved_config(COMMAND), tables or {}, PAGE)


def complete(out: Path, value: object = 1.5, **options: Any) -> Path:
    with open_run(out, COMMAND, **options) as run:
        finish(run, value)
    return out


def stop(out: Path, block: Callable[[Run], object]) -> None:
    """Open a run, do `block` and be interrupted."""

    def interrupted() -> None:
        with open_run(out, COMMAND) as run:
            block(run)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()


def value_of(out: Path) -> object:
    return json.loads((out / "metrics.json").read_text())["rows"][0]["value"]


# --- a whole run


def test_a_run_leaves_its_files_and_nothing_else(tmp_path: Path):
    t = np.arange(5) * 1e-3
    with open_run(tmp_path / "deep" / "out", COMMAND) as run:
        assert run.dir == tmp_path / "deep" / "out.partial"
        assert not run.resumed
        run.stage("mass+50/x", lambda: {"a": 1})
        (run.dir / "trace.json").write_text("{}")
        finish(run, tables={"steps": {"t [s]": t, "n": np.arange(5), "name": np.array(list("abcde"))}})
    out = tmp_path / "deep" / "out"
    names = {"metrics.json", "config.toml", "report.html", "steps.parquet", "trace.json"}
    assert {path.name for path in out.iterdir()} == names
    assert os.listdir(out.parent) == ["out"]
    read = pq.read_table(out / "steps.parquet")
    assert read.column_names == ["t [s]", "n", "name"]
    assert (read["t [s]"].to_numpy() == t).all()


def test_every_file_is_the_same_to_the_byte_for_the_same_command(tmp_path: Path):
    for name in ("a", "b"):
        with open_run(tmp_path / name, COMMAND) as run:
            finish(run, 1 / 3, {"steps": {"t [s]": np.arange(1000) / 3}})
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_the_config_says_command_seed_and_versions(tmp_path: Path):
    read = tomllib.loads((complete(tmp_path / "out") / "config.toml").read_text())
    assert read.pop("versions") == versions()
    assert read == COMMAND
    assert {"jackbench", "python", "numpy", "scipy", "casadi", "control"} == set(versions())
    assert "x" not in resolved_config({"x": None, "rigs": [{"x": None}]}).replace("rigs", "")


# --- metrics.json


def test_metrics_are_strict_json_in_the_order_given():
    text = metrics_json({"z": np.float64("nan"), "a": (np.inf, -0.0), "n": np.int64(3), "b": np.bool_(True), "e": "é"})
    assert text == '{\n  "z": null,\n  "a": [\n    null,\n    0.0\n  ],\n  "n": 3,\n  "b": true,\n  "e": "é"\n}\n'
    assert json.loads(metrics_json({"m": np.array([[1.0, np.nan]])})) == {"m": [[1.0, None]]}


@given(st.floats(-1e300, 1e300, allow_subnormal=False))
def test_the_last_bits_of_a_float_do_not_show(value):
    read = json.loads(metrics_json({"x": value}))["x"]
    assert read == pytest.approx(value, rel=1e-9, abs=0)
    if f"{value:.10g}" == f"{np.nextafter(value, 0):.10g}":
        assert metrics_json({"x": value}) == metrics_json({"x": np.nextafter(value, 0)})


@pytest.mark.parametrize("bad", [{1: 2}, {"a": object()}, {"a": {2: 3}}, {"a": 1j}])
def test_what_json_does_not_know_is_refused(bad):
    with pytest.raises(TypeError):
        metrics_json(bad)


# --- stages

RESULT = {
    "none": None,
    "rows": [1, 2.5, "x", True, [], {}],
    "nan": float("nan"),
    "inf": -np.inf,
    "third": 1 / 3,
    "arrays": [np.arange(6).reshape(2, 3), np.array([1 + 2j]), np.array(["a", "bc"]), np.array(3.0)],
}


def test_a_stage_comes_back_as_it_was_and_is_computed_once(tmp_path: Path):
    calls = []

    def compute() -> dict[str, Any]:
        calls.append(1)
        return RESULT

    def check(run: Run) -> None:
        got = run.stage("first", compute)
        np.testing.assert_equal(got, RESULT)
        assert [a.dtype for a in got["arrays"]] == [a.dtype for a in RESULT["arrays"]]

    stop(tmp_path / "out", check)
    stop(tmp_path / "out", check)
    assert len(calls) == 1


@pytest.mark.parametrize("bad", [(1, 2), {1: 2}, object(), {"a": np.array([object()])}, 1j])
def test_a_stage_that_would_come_back_different_is_refused(tmp_path: Path, bad):
    with pytest.raises(TypeError), open_run(tmp_path / "out", COMMAND) as run:
        run.stage("first", lambda: bad)


def test_a_name_stands_for_one_stage(tmp_path: Path):
    with open_run(tmp_path / "out", COMMAND) as run:
        run.stage("first", lambda: 1)
        with pytest.raises(ValueError, match="twice"):
            run.stage("first", lambda: 2)
        finish(run)


@pytest.mark.parametrize("name", ["@command", "../../x", "a/b", "..", "mass+50 é"])
def test_any_name_of_a_stage_stays_in_its_folder(tmp_path: Path, name: str):
    with open_run(tmp_path / "out", COMMAND) as run:
        before = set(run.dir.rglob("*"))
        assert run.stage(name, lambda: 5) == 5
        (new,) = set(run.dir.rglob("*")) - before
        assert new.parent == run.dir / "stages"
        finish(run)
    assert os.listdir(tmp_path) == ["out"]


def test_a_run_that_ends_without_finish_is_a_bug(tmp_path: Path):
    with pytest.raises(RuntimeError, match="without finish"), open_run(tmp_path / "out", COMMAND):
        pass


# --- stopped and resumed


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_run_resumes_where_it_was(tmp_path: Path, how: signal.Signals):
    out, wait = tmp_path / "out", tmp_path / "wait"
    wait.touch()
    with start(out) as process:
        assert until_second(process) == ["fresh", "first", "second"]
        process.send_signal(how)
    assert not out.exists()
    assert (tmp_path / "out.partial").is_dir()
    wait.unlink()
    with start(out) as process:
        said, errors = process.communicate()
    assert (process.returncode, errors) == (0, "")
    assert said.split() == ["resumed", "second"]
    assert os.listdir(tmp_path) == ["out"]
    with start(tmp_path / "whole") as process:
        process.communicate()
    assert (out / "metrics.json").read_bytes() == (tmp_path / "whole" / "metrics.json").read_bytes()


def test_two_processes_do_not_share_a_folder(tmp_path: Path):
    out, wait = tmp_path / "out", tmp_path / "wait"
    wait.touch()
    with start(out) as first:
        until_second(first)
        with start(out) as second:
            _, errors = second.communicate()
        assert second.returncode == 2
        assert "another process" in errors
        assert errors.count("\n") == 1
        with pytest.raises(InputError, match="another process"), open_run(out, {"command": "tune"}, force=True):
            pass
        wait.unlink()
        first.communicate()
    assert first.returncode == 0
    assert os.listdir(tmp_path) == ["out"]


@pytest.mark.parametrize("call", ["rename", "rmtree"])
@pytest.mark.parametrize("after", range(3))
def test_no_crash_while_publishing_loses_a_run(tmp_path: Path, monkeypatch, call: str, after: int):
    """Stop before each rename and each deletion: the old or the new run is there, and the same command mends all."""
    out = complete(tmp_path / "out", 1)
    left = [after]
    owner, real = ("pathlib.Path.rename", Path.rename) if call == "rename" else ("shutil.rmtree", shutil.rmtree)

    def crash(*args: Any, **options: Any) -> object:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        return real(*args, **options)

    monkeypatch.setattr(owner, crash)
    with suppress(KeyboardInterrupt):
        complete(out, 2, force=True)
    monkeypatch.undo()
    assert {value_of(path) for path in tmp_path.iterdir() if (path / "metrics.json").exists()} & {1, 2}
    complete(out, 3, force=True)
    assert os.listdir(tmp_path) == ["out"]
    assert value_of(out) == 3


# --- refused


def test_an_existing_folder_is_refused_before_anything_is_computed(tmp_path: Path):
    out = complete(tmp_path / "out", 1)
    with pytest.raises(InputError, match=r"exists already; .*--force"), open_run(out, COMMAND):
        pytest.fail("the block ran")
    assert os.listdir(tmp_path) == ["out"]
    assert value_of(out) == 1


def test_force_replaces_a_run_and_an_empty_folder_but_nothing_else(tmp_path: Path):
    out = complete(tmp_path / "out", 1)
    assert value_of(complete(out, 2, force=True)) == 2
    (tmp_path / "empty").mkdir()
    complete(tmp_path / "empty", force=True)
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").touch()
    with pytest.raises(InputError, match="is no run"), open_run(tmp_path / "thesis", COMMAND, force=True):
        pass
    assert sorted(os.listdir(tmp_path)) == ["empty", "out", "thesis"]


def test_an_unfinished_run_of_another_command_is_refused_and_kept(tmp_path: Path):
    stop(tmp_path / "out", lambda run: run.stage("first", lambda: 1))
    with pytest.raises(InputError, match="another command"), open_run(tmp_path / "out", COMMAND | {"seed": 8}):
        pass
    with open_run(tmp_path / "out", COMMAND) as run:
        assert run.stage("first", lambda: 2) == 1
        finish(run)
    shutil.rmtree(tmp_path / "out")
    stop(tmp_path / "out", lambda run: run.stage("first", lambda: 1))
    with open_run(tmp_path / "out", COMMAND | {"seed": 8}, force=True) as run:
        assert not run.resumed
        assert run.stage("first", lambda: 3) == 3
        finish(run)


def test_an_unfinished_run_of_other_versions_is_refused(tmp_path: Path, monkeypatch):
    stop(tmp_path / "out", lambda run: None)
    monkeypatch.setattr("workbench.runs.versions", lambda: {"numpy": "0"})
    with pytest.raises(InputError, match="other package versions"), open_run(tmp_path / "out", COMMAND):
        pass


def test_an_input_error_leaves_nothing_of_this_call(tmp_path: Path):
    def fail() -> None:
        with open_run(tmp_path / "a" / "b" / "out", COMMAND) as run:
            run.stage("first", lambda: 1)
            raise InputError("bad row")

    with pytest.raises(InputError, match="bad row"):
        fail()
    assert os.listdir(tmp_path) == []


def test_an_input_error_keeps_the_stages_of_an_earlier_call(tmp_path: Path):
    stop(tmp_path / "out", lambda run: run.stage("first", lambda: 1))
    with pytest.raises(InputError), open_run(tmp_path / "out", COMMAND):
        raise InputError("bad row")
    with open_run(tmp_path / "out", COMMAND) as run:
        assert run.stage("first", lambda: 2) == 1
        finish(run)


def test_a_file_in_the_way_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    (tmp_path / "x.partial").touch()
    for out, force in (("file", False), ("file", True), ("file/out", False), ("file/deep/out", True), ("x", True)):
        with pytest.raises(InputError, match="another --out"), open_run(tmp_path / out, COMMAND, force):
            pytest.fail("the block ran")
    assert sorted(os.listdir(tmp_path)) == ["file", "x.partial"]


def test_a_folder_of_somebody_else_called_partial_is_left_alone(tmp_path: Path):
    (tmp_path / "out.partial").mkdir()
    (tmp_path / "out.partial" / "notes.txt").touch()
    with pytest.raises(InputError, match="no unfinished run"), open_run(tmp_path / "out", COMMAND, force=True):
        pass
    assert os.listdir(tmp_path / "out.partial") == ["notes.txt"]


@pytest.mark.parametrize("out", ["/", "/dev/null/out"])
def test_a_place_that_can_not_be_written_is_refused(out: str):
    with pytest.raises(InputError, match="choose another --out"), open_run(Path(out), COMMAND):
        pass


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind root")
def test_a_read_only_parent_is_refused(tmp_path: Path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="Permission denied"), open_run(tmp_path / "out", COMMAND):
        pass


def test_a_lock_dies_with_its_process_even_if_a_worker_lives_on(tmp_path: Path):
    """A pool's workers may outlive a killed parent; they must not hold the folder."""
    code = (
        "import os, sys, time\nfrom pathlib import Path\nfrom workbench.runs import open_run\n"
        f"with open_run(Path({str(tmp_path / 'out')!r}), {COMMAND!r}):\n"
        "    worker = os.fork()\n"
        "    if worker == 0:\n        os.close(1), os.close(2), time.sleep(30), os._exit(0)\n"
        "    print(worker, flush=True)\n    time.sleep(30)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        worker = int(process.stdout.readline())
        process.kill()
    try:
        started = time.monotonic()
        with open_run(tmp_path / "out", COMMAND) as run:
            assert run.resumed
            finish(run)
        assert time.monotonic() - started < 5
    finally:
        os.kill(worker, signal.SIGKILL)
