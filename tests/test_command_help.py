"""What the command line says of itself: where to begin, examples that parse, groups, completion, doctor, open."""

import argparse
import json
import os
import shlex
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands import COMMANDS, GROUPS, folder
from workbench.commands.common.shipped import campaign, experiment
from workbench.commands.doctor.checks import GROUPS as EXTRAS
from workbench.commands.examples import EXAMPLES, FIRST
from workbench.commands.open.options import report_of

ROOT = Path(__file__).parents[1]
LINES = [*FIRST, *(line for name in EXAMPLES if name != "completion" for line in EXAMPLES[name])]


def test_alone_it_prints_the_five_things_that_people_do_first(capsys):
    assert main([]) == 0
    said = capsys.readouterr().out
    assert len(FIRST) == 5
    assert all(line in said and what in said for line, what in FIRST.items())


@pytest.mark.parametrize("line", LINES)
def test_an_example_is_a_line_that_its_command_takes(line):
    """Shipped files that it names are there; those of the reader need not be."""
    program, name, *words = shlex.split(line)
    assert program == "jackbench"
    parser = argparse.ArgumentParser(exit_on_error=False)
    import_module(f"workbench.commands.{folder(name)}.options").options(parser)
    given = vars(parser.parse_args(words))
    for action in parser._actions:
        if action.type in (experiment, campaign):
            values = given[action.dest] if isinstance(given[action.dest], list) else [given[action.dest]]
            assert all(path.exists() for path in values if path.suffix == "" and path.name not in ("campaign",))


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_has_two_examples_and_its_page(name, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([name, "--help"])
    assert stopped.value.code == 0
    said = capsys.readouterr().out
    assert len(EXAMPLES[name]) == 2
    assert all(f"  {line}\n" in said for line in EXAMPLES[name])
    assert f"reference/commands.html#jackbench-{name} " in said


def test_every_command_stands_once_in_a_group_and_the_help_shows_all(capsys):
    assert len(COMMANDS) == sum(map(len, GROUPS.values()))
    assert {"design", "diagnose", "deliver"} < set(GROUPS)
    with pytest.raises(SystemExit):
        main(["--help"])
    said = capsys.readouterr().out
    assert all(f"\n{group}:\n" in said for group in GROUPS)
    assert all(f"\n  {name} " in said for name in COMMANDS)


def completed(line: str, cwd: Path = ROOT) -> list[str]:
    """What a shell is offered for a line whose last word is being typed."""
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "COMP_LINE": line, "COMP_POINT": str(len(line))}
    code = "import os, sys; os.dup2(1, 8); from workbench.cli import main; main()"
    environment = {**os.environ, **asked, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
    done = subprocess.run([sys.executable, "-c", code], cwd=cwd, env=environment, capture_output=True, text=True)
    return [word.strip() for word in done.stdout.split("\n") if word.strip()]


def test_a_shell_completes_commands_options_and_names_of_what_is_shipped(tmp_path):
    pytest.importorskip("argcomplete")
    assert {"trace", "train", "trust"} == set(completed("jackbench tr"))
    assert completed("jackbench trace sample --sev") == ["--several"]
    assert {"tune_p", "tune_p_dp"} <= set(completed("jackbench tune tune_p", tmp_path))
    assert completed("jackbench residual sam", tmp_path) == ["sample"]
    assert completed("jackbench bench benchmark --rig fest", tmp_path) == ["festo-tp511"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_gets_a_script_that_asks_jackbench(shell, capsys):
    pytest.importorskip("argcomplete")
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "_ARGCOMPLETE" in script
    assert "jackbench" in script
    assert ("complete --command jackbench" in script) == (shell == "fish")


def test_the_doctor_knows_every_optional_group_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert set(EXTRAS) == set(project["optional-dependencies"])


def test_the_doctor_says_what_works_and_how_to_get_the_rest(capsys, monkeypatch):
    assert main(["doctor", "--json"]) == 0
    rows = {row["what"]: row for row in json.loads(capsys.readouterr().out)}
    assert rows["machine code"]["works"]
    assert set(EXTRAS) < set(rows)
    monkeypatch.setattr("workbench.commands.fmu.compiler.shutil.which", lambda _name: None)
    assert main(["doctor"]) == 0
    (line,) = [row for row in capsys.readouterr().out.splitlines() if row.startswith("  C compiler:")]
    assert "install gcc or clang" in line


def test_the_report_that_opens_is_the_run_named_or_the_newest(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="no finished run"):
        report_of(None)
    for age, name in enumerate(["old", "new"]):
        report = tmp_path / "out" / name / "report.html"
        report.parent.mkdir(parents=True)
        report.write_text("")
        os.utime(report, (1e9 + age, 1e9 + age))
    assert report_of(None) == Path("out/new/report.html")
    assert report_of("old") == Path("out/old/report.html") == report_of("out/old")
    with pytest.raises(InputError, match="other"):
        report_of("other")
