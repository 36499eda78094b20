"""A starter folder runs as it is written; a bundled rig is exported as a file that reads back the same."""

import json
import re
import tomllib
from importlib import import_module
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from workbench.cli import main
from workbench.commands import COMMANDS, folder
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.common.declared import Experiment, meanings
from workbench.commands.new.experiments import KINDS
from workbench.commands.tune.options import load_tune
from workbench.rigs.datasheet import load_datasheet
from workbench.rigs.rig_file import bundled, load_rig


@pytest.mark.parametrize("rig", ["jack-10t", "festo-tp511"])
def test_its_experiments_run_from_the_folder(tmp_path, monkeypatch, rig):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "mine", "--rig", rig]) == 0
    monkeypatch.chdir(tmp_path / "mine")
    assert main(["run", "step.toml"]) == 0
    rows = json.loads((tmp_path / "mine/out/step/metrics.json").read_text())["rows"]
    assert [row["controller"] for row in rows] == ["p", "mine"]
    for row in rows:
        assert row["stable"]
        assert not row["tripped"]
        assert row["gain_margin_db"] > 6
    assert load_tune("tune.toml").start.rig.numbers == load_rig(rig).numbers
    assert [spec.name for spec in BenchConfig.load("bench.toml").loops[0].controllers] == ["p", "mine"]


TWO_STAGE = """differential
210 bar
2
2 bar
40 l/min
70 bar
1
1 l/min
210 bar
100 %
5 Hz
60 Hz
80 Hz
20 cm^2
10cm^2
500 mm
200 kg
"""  # the first return pressure has no unit: it is asked for again


def test_a_datasheet_is_asked_for_and_gives_a_rig_with_first_gains(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", StringIO(TWO_STAGE))
    assert main(["new", "mine", "--ask", "two-stage"]) == 0
    assert "write a number and its unit" in capsys.readouterr().out
    assert main(["new", "again", "--datasheet", "mine/datasheet.toml"]) == 0
    rig = load_rig("mine/rig.toml")
    assert rig.numbers == load_rig("again/rig.toml").numbers
    assert rig["Pr"] == 2e5
    assert rig["AB"] == pytest.approx(1e-3)
    monkeypatch.chdir(tmp_path / "mine")
    assert main(["run", "step.toml"]) == 0
    for row in json.loads(Path("out/step/metrics.json").read_text())["rows"]:
        assert row["stable"]
        assert row["gain_margin_db"] > 6


def test_at_most_is_an_answer_for_leakage_and_hysteresis(tmp_path, monkeypatch):
    """Makers state both as what they are at most: half of it is taken, and all up to it allowed."""
    monkeypatch.chdir(tmp_path)
    answers = TWO_STAGE.replace("1 l/min\n", "at most 1 l/min\n", 1) + "< 3 %\n"
    rigs = {}
    for name, text in {"plain": TWO_STAGE.replace("1 l/min", "0.5 l/min", 1), "most": answers}.items():
        monkeypatch.setattr("sys.stdin", StringIO(text))
        assert main(["new", name, "--ask", "two-stage"]) == 0
        rigs[name] = load_rig(f"{name}/rig.toml").numbers
    sheet = load_datasheet("most/datasheet.toml")
    assert sheet.ranges["leakage"] == pytest.approx((0.05 / 6e4, 1 / 6e4))
    assert sheet.ranges["hysteresis"] == (0.0, 0.03)
    assert rigs["most"]["eps"].source == "datasheet: leakage at null, half of at most 1 l/min"
    plain, most = rigs["plain"]["eps"], rigs["most"]["eps"]
    assert most.value == pytest.approx(plain.value)
    assert (most.low, most.high) == pytest.approx((plain.value / 10, 2 * plain.value), rel=0.02)
    assert (rigs["plain"]["z0"].high, rigs["most"]["z0"].high) == pytest.approx((0.02, 0.035))


def test_a_piston_may_be_told_by_bore_and_rod_and_a_hose_by_bore_and_length(tmp_path, monkeypatch, capsys):
    """Its oil counts as dead volume; and a threshold widens the null as half of a hysteresis does."""
    monkeypatch.chdir(tmp_path)
    answers = TWO_STAGE.replace("20 cm^2", "50 mm").replace("10cm^2", "36 mm x 50 mm\n50 mm x 36 mm") + "2 %\n1 %\n"
    for name, hose in (("on", ""), ("beside", "20 mm / 2 m\n")):
        monkeypatch.setattr("sys.stdin", StringIO(answers + hose))
        assert main(["new", name, "--ask", "two-stage"]) == 0
    assert "a rod of 50 mm is no thinner than a bore of 36 mm" in capsys.readouterr().out
    on, beside = (load_rig(f"{name}/rig.toml") for name in ("on", "beside"))
    assert (on["AA"], on["AB"]) == pytest.approx((np.pi / 4 * 0.05**2, np.pi / 4 * (0.05**2 - 0.036**2)), rel=1e-4)
    assert "bore and rod, 50 mm x 36 mm" in on.numbers["AB"].source
    more = np.pi / 4 * 0.02**2 * 2
    assert [beside[name] - on[name] for name in ("V0A", "V0B")] == pytest.approx([more, more], rel=0.01)
    assert "0.628 l of hose" in beside.numbers["V0A"].source
    assert on.numbers["z0"].high == pytest.approx(0.02 + 0.015)


ANSWERED = {
    "plain": TWO_STAGE,
    "by sizes": TWO_STAGE.replace("20 cm^2", "50 mm").replace("10cm^2", "50 mm x 36 mm").replace("200 kg", "5 t"),
    "at most, open tank": TWO_STAGE.replace("2 bar", "0 bar").replace("1 l/min", "at most 1 l/min", 1) + "< 3 %\n1 %\n",
    "with a hose": TWO_STAGE.replace("\n1\n", "\n4\n") + "\n\n19 mm x 2 m\n",
    "double-rod": TWO_STAGE.replace("differential", "double-rod").replace("10cm^2\n", ""),
}


@pytest.mark.parametrize("answers", ANSWERED.values(), ids=ANSWERED)
def test_every_number_that_is_written_has_bounds_or_says_why_it_has_none(tmp_path, monkeypatch, answers):
    """In the file itself: what is exact says so, limits are declared, sensors are assumed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", StringIO(answers))
    assert main(["new", "mine", "--ask", "two-stage"]) == 0
    rig = tomllib.loads(Path("mine/rig.toml").read_text())
    for section in ("supply", "oil", "valve", "jack", "load"):
        for name, number in rig[section].items():
            if not isinstance(number, dict):
                continue
            if "bounds" in number:
                low, high = number["bounds"]
                assert low <= number["value"] <= high, name
                assert low < high, name
                assert number["source"].startswith(("datasheet", "estimate")), name
            else:
                assert "; exact: " in number["source"], name
    declared = [*rig["limits"].values(), rig["control"]["period"]]
    assert all(number["source"].startswith("declared here: ") for number in declared)
    assumed = [sensor[key] for sensor in rig["sensors"].values() for key in ("noise", "resolution")]
    assert all(number["source"].startswith("assumed: ") for number in assumed)


def test_answers_that_end_name_all_that_is_missing_and_leave_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", StringIO("double-rod\n210 bar\n"))
    assert main(["new", "mine", "--ask", "three-stage"]) == 2
    complaint = capsys.readouterr().err
    for name in ("rated_flow", "pilot_flow", "imax", "pilot f3db", "main f90", "Aj", "S", "M"):
        assert name in complaint
    assert not list(tmp_path.iterdir())


def test_what_its_readme_names_is_there(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "mine"]) == 0
    text = (tmp_path / "mine" / "README.md").read_text()
    for name in ("rig.toml", "step.toml", "tune.toml", "bench.toml", "mine.py", "campaign/campaign.toml"):
        assert name in text
        assert (tmp_path / "mine" / name).is_file()
    assert main(["residual", "mine/campaign"]) == 2
    assert "static.csv" in capsys.readouterr().err


def kinds(of: type[Experiment] = Experiment) -> set[type[Experiment]]:
    """Every kind of experiment that the workbench declares."""
    for command in COMMANDS:
        import_module(f"workbench.commands.{folder(command)}.options")
    own = {of} if "KIND" in vars(of) and of.__module__.startswith("workbench.") else set()
    return own.union(*map(kinds, of.__subclasses__()))


def test_every_declared_kind_has_a_starter_that_loads_and_names_its_keys(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    loaded = set()
    for of, rig in {"jack": "jack-10t", "platform": "hexapod"}.items():
        assert main(["new", of, "--rig", rig]) == 0
        for name, kind in KINDS[of].items():
            text = (tmp_path / of / name).read_text()
            assert isinstance(kind.load(tmp_path / of / name), kind)
            further = set(re.findall(r"^#   (\w+): ", text, re.MULTILINE))
            assert further.isdisjoint(tomllib.loads(text))
            assert further | tomllib.loads(text).keys() == meanings(kind).keys()
            assert all(meaning in text for meaning in meanings(kind).values())
            assert f" {name} " in (tmp_path / of / "README.md").read_text()
            loaded.add(kind)
    assert loaded == kinds()


def test_an_experiment_that_the_rig_cannot_play_is_left_out(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "crane", "--rig", "crane"]) == 0
    for name in ("bench.toml", "automatic.toml", "paper.toml"):
        assert not (tmp_path / "crane" / name).exists()
        assert name not in (tmp_path / "crane" / "README.md").read_text()


def test_an_existing_folder_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    assert main(["new", "mine"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert not list((tmp_path / "mine").iterdir())
    assert main(["new", "yours", "--rig", "jack"]) == 2
    assert main(["new", "no/where"]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


@pytest.mark.parametrize("name", bundled())
def test_a_bundled_rig_is_exported_as_a_file(tmp_path, capsys, name):
    assert main(["show", name, "--toml"]) == 0
    printed = capsys.readouterr().out
    assert main(["show", name, "--out", str(tmp_path / "mine.toml")]) == 0
    assert (tmp_path / "mine.toml").read_text() == printed
    assert load_rig(tmp_path / "mine.toml").numbers == load_rig(name).numbers
    assert main(["show", name, "--out", str(tmp_path / "mine.toml")]) == 2
