"""`jackbench inverse`: the record with and without the inverse, and the loop through the reference."""

import json

import pyarrow.parquet as pq
import pytest

from workbench.base.signals import SIGNALS
from workbench.cli import main
from workbench.commands.inverse.page import changed

EXPERIMENT = """
experiment = "inverse"
rig = "jack-10t"
rigs = ["nominal", "beta-50"]
designed_on = ["nominal"]
scenarios = ["sine"]
rest = "0.5 s"
fade = "0.5 s"
preview = "60 ms"
length = "200 ms"
band = "5 Hz"
[scenario.sine]
size = "20 mm"
frequency = "2 Hz"
seconds = "2 s"
[controllers.p-dp]
use = "controllers.p:P"
gain = "3.5 1/m"
[[controllers.p-dp.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = "1.6e-4 1/bar"
corner = "0.25 Hz"
"""
OUTER = """
[specimen]
stiffness = "1 kN/mm"
damping = "1000 N s/m"
[outer]
signal = "force"
numerator = [-1.0]
denominator = [6000.0, 10000.0, 100000.0]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_error_is_a_third_on_a_rig_of_the_design_and_on_another(folder):
    (folder / "inverse.toml").write_text(EXPERIMENT)
    assert main(["inverse", "inverse.toml"]) == 0
    metrics = json.loads((folder / "out/inverse/metrics.json").read_text())
    assert [row["rig"] for row in metrics["rows"]] == ["nominal", "beta-50"]
    assert all(row["factor"] > 3 and row["tripped"] is None for row in metrics["rows"])
    assert metrics["outer"] == []
    taps = pq.read_table(folder / "out/inverse/taps-p-dp.parquet")
    assert sum(taps["tap"].to_pylist()) == pytest.approx(1.0)
    assert taps["ahead"].to_pylist()[0] == 60
    assert (folder / "out/inverse/drive-p-dp.csv").read_text().startswith("t [s],position [mm]")


def test_the_loop_through_the_reference_is_shown_beside_the_inner_one(folder):
    (folder / "inverse.toml").write_text(EXPERIMENT.replace('"60 ms"', '"0 ms"') + OUTER)
    assert main(["inverse", "inverse.toml"]) == 0
    rows = json.loads((folder / "out/inverse/metrics.json").read_text())["outer"]
    assert len(rows) == 8  # rigs, null and moving, with and without
    assert all(row["inner_ms"] < 2.2 and row["inner_gain_margin_db"] > 6 for row in rows)
    first, second = rows[:2]
    assert (first["reference"], first["stable"], first["ms"]) == ("as it is", False, None)
    assert (second["reference"], second["stable"]) == ("inverse", True)
    assert "unstable at" in (folder / "out/inverse/report.html").read_text()


def test_an_inverse_that_makes_the_error_larger_is_said_to():
    worse = {"factor": 0.5, "error_rms": 1e-3, "error_rms_inverse": 2e-3}
    better = {"factor": 4.0, "error_rms": 1e-3, "error_rms_inverse": 0.25e-3}
    signal = SIGNALS["position"]
    said = changed(signal, [worse])
    assert said == "makes the error 2 times as large, which is 1 mm RMS without and 2 mm with it"
    said = changed(signal, [better, worse])
    assert said.startswith("divides the error by 4 on 1 of 2 rigs and makes the error 2 times as large on 1 of 2 rigs")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('designed_on = ["nominal"]', 'designed_on = ["mass-50"]', 'designed_on: "mass-50" is not in the list'),
        ('preview = "60 ms"', 'preview = "300 ms"', "preview: must be below the length"),
        ('"3.5 1/m"', '"90 1/m"', "no linear stable loop on nominal, null"),
        ("stiffness = ", "stifness = ", "stifness"),
        ('signal = "force"', 'signal = "fors"', "fors"),
        ("numerator = [-1.0]", "numerator = [1.0, 1.0, 1.0, 1.0]", "higher power"),
        ("denominator = [6000.0,", "denominator = [0.0,", "begins with 0"),
        (OUTER[: OUTER.index("[outer]")], "", "has nothing to act on"),
    ],
)
def test_what_makes_no_inverse_is_refused(folder, capsys, old, new, said):
    text = EXPERIMENT + OUTER
    assert old in text
    (folder / "inverse.toml").write_text(text.replace(old, new))
    assert main(["inverse", "inverse.toml"]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("jackbench:") == 1
