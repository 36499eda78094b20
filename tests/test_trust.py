"""Code that comes with data runs only where the user has said so; nothing is imported from the working folder."""

import subprocess
import sys
from pathlib import Path

import pytest

from workbench.base import trust
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.plant.effects import load_effects
from workbench.rigs.rig_file import save_rig

CODE = """
from pathlib import Path
from workbench.plant.effects import effect, number
Path(__file__).with_name("ran").touch()

@effect("my.drag", "linear", equation="force", slot="body_force", source="our own", shows="all",
        numbers=(number("c", 1.0, "N s/m", low=0.0, high=10.0, off=0.0, meaning="drag"),))
def drag(force, s):
    return force + s.p("c") * s["velocity"]
"""
WORKERS = """
from operator import pos
from workbench.base.process_pool import process_pool
from workbench.cli import main

def make():
    return pos

if __name__ == "__main__":
    main(["list", "rigs"])
    with process_pool(2, make) as pool:
        print(pool({"a": 1, "b": 2}, lambda name, compute: compute(), lambda result: None))
"""


@pytest.fixture
def foreign(tmp_path, monkeypatch, rig):
    """The folder of a rig that somebody sent, with code of theirs that leaves a file "ran"; nothing is trusted yet."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("JACKBENCH_TRUSTED", "")
    folder = tmp_path / "foreign"
    folder.mkdir()
    save_rig(rig, folder / "rig.toml")
    text = (folder / "rig.toml").read_text("utf-8")
    (folder / "rig.toml").write_text(f'effect_files = ["mine.py"]\n{text}\n[[effects]]\nname = "my.drag"\n', "utf-8")
    (folder / "mine.py").write_text(CODE, "utf-8")
    return folder


def has_run(folder):
    """Whether the code has run since this was asked last."""
    ran = (folder / "ran").exists()
    (folder / "ran").unlink(missing_ok=True)
    return ran


def test_code_that_a_rig_names_is_refused_in_one_line(foreign, capsys):
    assert main(["show", str(foreign / "rig.toml")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"jackbench trust {foreign / 'mine.py'}" in error
    assert not has_run(foreign)


def test_trust_is_remembered_until_the_file_changes(foreign, capsys):
    assert main(["trust", str(foreign / "mine.py")]) == 0
    assert main(["show", str(foreign / "rig.toml")]) == 0
    assert has_run(foreign)
    (foreign / "mine.py").write_text(CODE + "# another line", "utf-8")
    assert main(["show", str(foreign / "rig.toml")]) == 2
    assert not has_run(foreign)
    assert "not trusted" in capsys.readouterr().err


def test_trust_once_is_not_remembered(foreign, monkeypatch):
    assert main(["show", str(foreign / "rig.toml"), "--trust"]) == 0
    assert has_run(foreign)
    monkeypatch.setenv("JACKBENCH_TRUSTED", "")  # as in the next process
    assert main(["show", str(foreign / "rig.toml")]) == 2
    assert not has_run(foreign)


def test_a_list_that_others_could_have_written_is_not_believed(foreign):
    list_file = trust.trust(foreign / "mine.py")
    load_effects(foreign / "mine.py")
    list_file.chmod(0o666)
    with pytest.raises(InputError, match="not trusted"):
        load_effects(foreign / "mine.py")


def test_a_residual_runs_no_code_that_a_campaign_brings(foreign, capsys):
    """campaign.toml names a rig file, which names code."""
    sample = Path(__file__).parents[1] / "experiments" / "sample"
    for path in sample.iterdir():
        (foreign / path.name).write_bytes(path.read_bytes())
    text = (sample / "campaign.toml").read_text("utf-8")
    assert 'rig = "jack-10t"' in text
    (foreign / "campaign.toml").write_text(text.replace('rig = "jack-10t"', 'rig = "rig.toml"'), "utf-8")
    assert main(["residual", str(foreign), "--out", str(foreign / "out")]) == 2
    assert "mine.py" in capsys.readouterr().err
    assert not has_run(foreign)
    assert not (foreign / "out").exists()


@pytest.mark.parametrize(("file", "words"), [("absent.py", "no such file"), ("rig.toml", "no Python file")])
def test_what_cannot_be_trusted_is_refused(foreign, capsys, file, words):
    assert main(["trust", str(foreign / file)]) == 2
    error = capsys.readouterr().err
    assert file in error
    assert words in error


def test_a_command_and_its_workers_import_nothing_from_the_working_folder(tmp_path):
    """Files named as packages and as modules of Python lie beside recordings."""
    for name in ("pandas", "numpy", "random", "pickle", "scipy", "controllers", "casadi"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('imported from the working folder')", "utf-8")
    script = tmp_path / "scripts" / "workers.py"
    script.parent.mkdir()
    script.write_text(WORKERS, "utf-8")
    for command in ([Path(sys.executable).with_name("jackbench"), "list", "rigs"], [sys.executable, script]):
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert "imported from the working folder" not in done.stderr
    assert done.stdout.endswith("[1, 2]\n")
