"""What other systems ask of files and consoles, as far as it shows on this one."""

import io
import os
import sys
from pathlib import Path

import pytest
from made_runs import COMMAND, finish, stop

from workbench import cli
from workbench.base import files
from workbench.commands.common import run_folder
from workbench.commands.common.run_folder import open_run


@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc which files are open")
@pytest.mark.parametrize("windows", [True, False])
def test_windows_renames_a_folder_with_no_file_open_in_it(tmp_path: Path, monkeypatch, windows):
    monkeypatch.setattr(files, "WINDOWS", windows)
    monkeypatch.setattr(run_folder, "WINDOWS", windows)
    inside = []
    rename = Path.rename

    def renamed(path, target):
        paths = [os.readlink(link) for link in Path("/proc/self/fd").iterdir() if os.path.lexists(link)]
        inside.extend(each for each in paths if each.startswith(str(path)))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", renamed)
    with open_run(tmp_path / "out", COMMAND) as run:
        run.stage("a", lambda: 1)
        finish(run)
    assert (tmp_path / "out" / "metrics.json").exists()
    assert [Path(path).name for path in inside] == ([] if windows else ["@lock"])


def test_stages_that_differ_by_case_have_files_that_differ_without_it(tmp_path: Path):
    stop(tmp_path / "out", lambda run: [run.stage(name, lambda: 1) for name in ("p", "P", "pI", "Pi")])
    names = [path.name for path in (tmp_path / "out.partial" / "stages").glob("*.json") if path.name[0] != "@"]
    assert len({name.lower() for name in names}) == len(names) == 4


def test_a_console_without_a_sign_shows_a_question_mark(monkeypatch):
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii"))
    monkeypatch.setattr(cli, "_first_words", lambda: "χ² ≤ 1")
    assert cli.main([]) == 0
    sys.stdout.flush()
    assert shown.getvalue() == b"?? ? 1\n"
