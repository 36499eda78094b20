"""A sheet is a datasheet: a rig that is made of one plays it again, within the sheet's own intervals."""

import json

import pytest

from workbench.cli import main
from workbench.rigs.rig_file import load_rig

CURVE = ("main_flow", "flow_gain_extending", "flow_gain_retracting", "lap", "null_bias", "main_25_f3db", "main_25_f90")


def again(rig, folder):
    sheet, out = folder / "sheet", folder / "rig"
    assert main(["valve-test", rig, "--out", str(sheet)]) == 0
    assert main(["new-rig", str(sheet / "metrics.json"), "--like", rig, "--out", str(out)]) == 0
    return out, {row["id"]: row for row in json.loads((out / "metrics.json").read_text())["rows"]}


def test_a_second_order_valve_plays_every_line_of_its_sheet_again(tmp_path):
    out, rows = again("festo-tp511", tmp_path)
    assert len(rows) == 25
    assert all(row["within"] for row in rows.values())
    made, like = load_rig(str(out / "rig.toml")), load_rig("festo-tp511")
    assert made["M"] == like["M"]
    assert made["f0"] == pytest.approx(like["f0"], rel=2e-3)
    assert "valve sheet" in made.numbers["K3"].source


def test_a_three_stage_valve_s_flow_curve_and_one_response_come_back(tmp_path):
    _, rows = again("jack-10t", tmp_path)
    assert all(rows[id]["within"] for id in CURVE)


@pytest.mark.parametrize(
    ("rows", "words", "told"),
    [
        ([], ["--like", "jack-10t"], "no flow_gain_extending"),
        (None, ["--like", "jack-10t"], "no sheet of valve-test"),
        ([], [], "--like"),
        ([], ["--like", "pump-rig"], "no servo-valve"),
    ],
)
def test_what_is_no_sheet_is_one_line(rows, words, told, tmp_path, capsys):
    path = tmp_path / "metrics.json"
    path.write_text(json.dumps({"rows": rows}))
    assert main(["new-rig", str(path), *words, "--out", str(tmp_path / "out")]) == 2
    assert told in capsys.readouterr().err.strip().splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_an_overlapped_valve_is_refused_with_the_effect_that_it_needs(tmp_path, capsys):
    line = {"value": 500.0, "low": 499.0, "high": 501.0}
    rows = [{"id": f"flow_gain_{way}", **line} for way in ("extending", "retracting")]
    rows += [{"id": "lap", "value": 2.0, "low": 1.9, "high": 2.1}, {"id": "null_bias", **line}]
    path = tmp_path / "metrics.json"
    path.write_text(json.dumps({"rows": rows}))
    assert main(["new-rig", str(path), "--like", "jack-10t", "--out", str(tmp_path / "out")]) == 2
    assert "main.deadband" in capsys.readouterr().err
