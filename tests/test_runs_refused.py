"""Runs that are refused leave what was there as it was."""

import os
import shutil
from pathlib import Path

import pytest
from made_runs import COMMAND, complete, finish, stop, value_of

from workbench.base.errors import InputError
from workbench.commands.common.run_folder import open_run


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


def test_force_uses_nothing_of_an_unfinished_run_of_the_same_command(tmp_path: Path):
    stop(tmp_path / "out", lambda run: run.stage("first", lambda: 1))
    with open_run(tmp_path / "out", COMMAND, force=True) as run:
        assert not run.resumed
        assert run.stage("first", lambda: 2) == 2
        finish(run)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"\xff", b"{}"])
def test_an_unfinished_run_that_does_not_say_whose_it_is_is_refused_and_cleared_by_force(tmp_path: Path, content):
    stop(tmp_path / "out", lambda run: run.stage("first", lambda: 1))
    (tmp_path / "out.partial" / "stages" / "@command.json").write_bytes(content)
    with pytest.raises(InputError, match=r"cannot be read any more.*--force"), open_run(tmp_path / "out", COMMAND):
        pass
    with open_run(tmp_path / "out", COMMAND, force=True) as run:
        assert run.stage("first", lambda: 2) == 2
        finish(run)


def test_stages_of_nobody_are_not_taken(tmp_path: Path):
    stop(tmp_path / "out", lambda run: run.stage("first", lambda: 1))
    (tmp_path / "out.partial" / "stages" / "@command.json").unlink()
    with open_run(tmp_path / "out", COMMAND) as run:
        assert run.stage("first", lambda: 2) == 2
        finish(run)


def test_an_unfinished_run_of_other_versions_is_refused(tmp_path: Path, monkeypatch):
    stop(tmp_path / "out", lambda run: None)
    monkeypatch.setattr("workbench.commands.common.run_folder.versions", lambda: {"numpy": "0"})
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
