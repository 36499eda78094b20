"""An experiment is declared once: its file, its options, its Python and its reference page are made of its fields."""

import argparse
import tomllib
from pathlib import Path

import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.declared import (
    Experiment,
    count,
    declared,
    fraction,
    meanings,
    quantity,
    takes_experiment,
)
from workbench.commands.common.experiment_file import with_names
from workbench.commands.sines.options import SinesConfig
from workbench.commands.tune.options import load_tune

EXPERIMENTS = Path(__file__).parents[1] / "experiments"


@declared
class Knocks(Experiment):
    KIND = "knocks"
    seconds: float = quantity("s", 0.5, 60.0, "how long it is watched")
    knocks: int = count(1, 9, "number of knocks", asked=True)
    level: float = fraction("of the largest force", default=0.5)


def knocks(folder: Path, text: str) -> Path:
    path = folder / "knocks.toml"
    path.write_text(f'experiment = "knocks"\n{text}\n')
    return path


def test_a_field_is_a_key_an_option_and_a_row_of_the_reference(tmp_path, capsys):
    path = knocks(tmp_path, 'seconds = "900 ms"\nknocks = 3')
    read = Knocks.load(path)
    assert (read.seconds, read.knocks, read.level) == (0.9, 3, 0.5)
    assert Knocks.load(path, knocks=5).asked == {"knocks": 5}
    assert meanings(Knocks)["level"] == "share, at most 1, of the largest force"
    parser = argparse.ArgumentParser()
    takes_experiment(parser, "a knocks experiment", Knocks, "knocks.study:run")
    assert parser.parse_args([str(path), "--knocks", "4"]).knocks == 4
    assert "number of knocks (default: the experiment's)" in parser.format_help()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('seconds = "1 s"', "knocks: missing"),
        ('seconds = "1 s"\nknocks = 10', "line 3: knocks = 10: must be a whole number, from 1 to 9"),
        ('seconds = "1 ms"\nknocks = 1', "line 2: seconds: 0.001 s is outside 0.5 to 60 s"),
        ('seconds = "1 s"\nknocks = 1\nlevel = 2', "line 4: level: a share of the largest force, at most 1"),
        ('second = "1 s"', 'line 2: second: unknown key; did you mean "seconds"?'),
    ],
)
def test_a_file_is_held_to_what_the_fields_declare(tmp_path, text, says):
    with pytest.raises(InputError) as refused:
        Knocks.load(knocks(tmp_path, text))
    assert says in str(refused.value)


def test_python_is_held_to_the_same(tmp_path):
    assert Knocks(seconds="2 s", knocks=1).seconds == 2.0  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match=r"knocks: seconds: 0\.1 s is outside 0\.5 to 60 s"):
        Knocks(seconds=0.1, knocks=1)
    with pytest.raises(InputError, match="knocks: knocks: is 10; give a whole number, 1 to 9"):
        Knocks(seconds=1.0, knocks=10)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["serve", "nothere", "--port", "70000"], "--port 70000: must be 0 or more, 65535 at most"),
        (["serve", "nothere", "--page-port", "-1"], "--page-port -1: must be 0 or more, 65535 at most"),
        (["commission", "nothere", "--at", "udp://127.0.0.1:9", "--minutes", "nan"], "--minutes nan: must be 2"),
        (["limit", "nothere", "--margin=-1 bar"], "--margin -1 bar: -100000 Pa is outside 0 to 1e+09 Pa"),
        (["capability", "nothere", "--pump", "5 kg"], "--pump 5 kg: "),
        (["force-test", "nothere", "--specimen", "1e12 N/m"], "--specimen 1e12 N/m: 1e+12 N/m is outside"),
    ],
)
def test_an_option_is_held_to_its_bounds_before_anything_is_read(words, says, capsys):
    assert main(words) == 2
    assert capsys.readouterr().err.startswith(f"jackbench: {says}")


def test_names_of_before_are_read_with_a_line_that_says_todays(tmp_path, capsys):
    text = (EXPERIMENTS / "tune_p.toml").read_text()
    (tmp_path / "now.toml").write_text(text)
    before = {
        "[within]": "[draw]",
        "designs =": "trials =",
        "settling_s =": "settling =",
        "ms = 0.1": "robustness = 0.1",
    }
    for today, then in before.items():
        text = text.replace(today, then)
    (tmp_path / "before.toml").write_text(text)
    now = load_tune(tmp_path / "now.toml")
    assert not capsys.readouterr().err
    before = load_tune(tmp_path / "before.toml")
    assert (before.factors, before.designs, before.source) == (now.factors, now.designs, now.source)
    assert before.weights == now.weights
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition("before.toml: line ")[2].partition(": ")[2].partition(";")[0] for line in lines] == [
        "trials: is called designs now",
        "draw: is called within now",
        "weights.settling: is called settling_s now",
        "weights.robustness: is called ms now",
    ]


def test_what_ships_has_todays_names():
    files = [path for folder in (EXPERIMENTS, EXPERIMENTS.parent / "docs" / "files") for path in folder.rglob("*.toml")]
    assert len(files) > 50
    for path in files:
        old = []
        with_names(tomllib.loads(path.read_text("utf-8")), (), old)
        assert not old, path


def test_an_old_name_beside_todays_is_refused(tmp_path):
    text = (EXPERIMENTS / "sines.toml").read_text()
    (tmp_path / "both.toml").write_text(text.replace("[within]", "[draw]\nM = [0.5, 1.5]\n\n[within]"))
    with pytest.raises(InputError, match="draw: is called within now, which is there too; remove one"):
        SinesConfig.load(tmp_path / "both.toml")


def test_a_complaint_about_a_renamed_table_names_its_line(tmp_path):
    text = (EXPERIMENTS / "sines.toml").read_text().replace("[within]", "[draw]").replace("M = [0.5", "M = [2.5")
    text = text.replace('"position_tuned.toml"', f'"{EXPERIMENTS / "position_tuned.toml"}"')
    line = text[: text.index("M = [2.5")].count("\n") + 1
    (tmp_path / "old.toml").write_text(text)
    with pytest.raises(InputError, match=rf"line {line}: within\.M: write the least and the largest factor"):
        SinesConfig.load(tmp_path / "old.toml")


def test_an_option_of_before_is_taken_with_a_line_that_says_todays(capsys):
    assert main(["retune", "nothere.toml", "--found", "x.toml", "--trials=3"]) == 2
    before, refused = capsys.readouterr().err.splitlines()
    assert before == "jackbench: --trials=3: is called --designs now; the next version knows no other name"
    assert "nothere.toml: no such file" in refused
