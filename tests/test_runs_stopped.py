"""Runs that are stopped, by processes that are really stopped: they resume, and no folder is shared or lost."""

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from made_runs import COMMAND, complete, finish, value_of

from workbench.base.errors import InputError
from workbench.commands.common.run_folder import open_run
from workbench.commands.compare.finished import load

ROOT = Path(__file__).parents[1]

# Two stages; the second announces itself and waits to be stopped while a file called "wait" is beside the output.
SCRIPT = """
import sys, time
from pathlib import Path
from workbench.base.errors import InputError
from workbench.report import Page, render
from workbench.commands.common.run_folder import open_run, resolved_config

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
        run.finish({"rows": rows}, resolved_config(command), {}, render(Page("t", "v", [])))
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


@pytest.mark.parametrize("force", [False, True])
def test_a_run_that_is_stopped_after_the_renaming_is_whole(tmp_path: Path, monkeypatch, force: bool):
    """What only resuming needs is still there, or the run that was replaced: to compare and to a command it is done."""
    out, other = tmp_path / "out", complete(tmp_path / "other", 1)
    if force:
        complete(out, 1)

    def stopped(path: Path, **_: Any) -> None:
        if path.name == "stages":
            raise KeyboardInterrupt

    monkeypatch.setattr("shutil.rmtree", stopped)
    with pytest.raises(KeyboardInterrupt):
        complete(out, 2, force=force)
    monkeypatch.undo()
    assert (out / "stages").is_dir()
    assert [run.rows for run in load([out, other])] == [[{"value": 2}], [{"value": 1}]]
    with pytest.raises(InputError, match="exists already"):
        complete(out, 3)
    assert sorted(os.listdir(tmp_path)) == ["other", "out"]
    assert "stages" not in os.listdir(out)
    assert value_of(out) == 2


def test_a_lock_dies_with_its_process_even_if_a_worker_lives_on(tmp_path: Path):
    """A pool's workers may outlive a killed parent; they must not hold the folder."""
    code = (
        "import os, sys, time\nfrom pathlib import Path\nfrom workbench.commands.common.run_folder import open_run\n"
        f"with open_run(Path({str(tmp_path / 'out')!r}), {COMMAND!r}):\n"
        "    if os.fork() == 0:\n"  # the worker speaks: what follows a fork has then run in it
        "        print(os.getpid(), flush=True), os.close(1), os.close(2), time.sleep(30), os._exit(0)\n"
        "    time.sleep(30)\n"
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
