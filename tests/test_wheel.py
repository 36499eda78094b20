"""The wheel in a new environment and an empty folder: the packages are ours, and what ships is found by name."""

import json
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
pytest.importorskip("hatchling")


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """The interpreter of an environment with the wheel, which sees the packages of this one behind its own."""
    folder = tmp_path_factory.mktemp("wheel")
    quiet = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", "."]
    subprocess.run([*quiet, str(ROOT)], cwd=folder, check=True)
    (wheel,) = folder.glob("jackbench-*.whl")
    venv.create(folder / "env", with_pip=False, symlinks=True)
    interpreter = folder / "env" / "bin" / "python"
    where = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(subprocess.run([interpreter, "-c", where], capture_output=True, text=True, check=True).stdout.strip())
    into = ["--no-deps", "--no-index", "--target", str(site), str(wheel)]
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", *into], check=True)
    (site / "behind.pth").write_text(sysconfig.get_path("purelib"))
    return interpreter


@pytest.fixture
def jackbench(python, tmp_path):
    def call(*words: str, cwd: Path = tmp_path) -> str:
        command = [python, "-m", "workbench.cli", *words]
        environment = {"PATH": "/usr/bin:/bin", "HOME": str(Path.home()), "PYTHONSAFEPATH": "1"}
        done = subprocess.run(
            command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return call


def test_the_packages_are_those_of_the_wheel(python, tmp_path):
    code = "import workbench, controllers, envs; print(workbench.__file__, controllers.__file__, envs.__file__)"
    done = subprocess.run([python, "-P", "-c", code], cwd=tmp_path, env={}, capture_output=True, text=True, check=True)
    assert all(Path(file).is_relative_to(python.parents[1]) for file in done.stdout.split())


def test_what_ships_is_found_by_name(jackbench, tmp_path):
    names = {row["name"] for row in json.loads(jackbench("list", "experiments", "--json"))}
    assert {"paper", "position_step", "benchmark", "sample"} <= names
    jackbench("run", "paper")
    assert len(json.loads((tmp_path / "out/paper/metrics.json").read_text())["rows"]) == 8
    jackbench("residual", "sample")
    assert (tmp_path / "out/residual-sample/report.html").is_file()


def test_a_starter_folder_runs(jackbench, tmp_path):
    jackbench("new", "mine")
    jackbench("run", "step.toml", cwd=tmp_path / "mine")
