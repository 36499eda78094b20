"""What a release refuses: files that state another version or day, and a tree that is not committed."""

import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from release import DATED, ROOT, STATED, disagreements, uncommitted

VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]


@pytest.fixture
def tree(tmp_path):
    for name in STATED:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def test_this_tree_states_one_version_and_one_day():
    assert not list(disagreements(ROOT, VERSION))


@pytest.mark.parametrize("name", STATED)
def test_a_file_that_states_another_version_is_named(tree, name):
    path = tree / name
    path.write_text(path.read_text("utf-8").replace(VERSION, "9.9.9"), "utf-8")
    (line,) = disagreements(tree, VERSION)
    assert line.startswith(f"{name} states 9.9.9")


@pytest.mark.parametrize("name", DATED)
def test_a_release_without_its_day_is_refused(tree, name):
    path = tree / name
    lines = path.read_text("utf-8").splitlines()
    undated = [
        line.partition(",")[0] + ", unreleased" if line.startswith("## ") and "," in line else line for line in lines
    ]
    path.write_text("\n".join(line for line in undated if not line.startswith("date-released")), "utf-8")
    (line,) = disagreements(tree, VERSION)
    assert f"{name} states nothing" in line


def test_a_file_that_is_not_committed_is_named(tmp_path):
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    assert not list(uncommitted(tmp_path))
    Path(tmp_path, "new.py").touch()
    assert list(uncommitted(tmp_path)) == ["new.py is not committed"]
