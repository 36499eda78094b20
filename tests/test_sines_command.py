"""`jackbench sines`: rows of every way on the rigs, the drawn plants, and what is refused."""

import json

import pytest

from workbench.cli import main
from workbench.rigs.oil import CAVITATES

EXPERIMENT = """
experiment = "sines"
rig = "jack-10t"
rigs = ["nominal", "mass+50"]
amplitude = "10 mm"
frequencies = [5, 10]
harmonics = 3
plants = 4
stroke = 0.9
seed = 1
[within]
M = [0.5, 1.5]
[controllers.p-dp]
use = "controllers.p:P"
gain = "4 1/m"
[[controllers.p-dp.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = "2.5e-4 1/bar"
corner = "1 Hz"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_way_has_a_row_and_corrected_sines_arrive(folder, capsys):
    (folder / "sines.toml").write_text(EXPERIMENT)
    assert main(["sines", "sines.toml"]) == 0
    metrics = json.loads((folder / "out/sines/metrics.json").read_text())
    rows = metrics["rows"]
    assert [(r["rig"], r["way"], r["frequency"]) for r in rows[:3]] == [
        ("nominal", way, 5.0) for way in ("alone", "apc", "apc+ahc")
    ]
    assert len(rows) == 12
    for row in rows:
        assert row["within"] is (row["way"] != "alone")
        assert (row["cycles"] is None) is (row["way"] == "alone")
        assert row["lowest_pressure_bar"] == pytest.approx(row["lowest_pressure"] / 1e5)
        assert (row["cavitation_s"] > 0) is (row["lowest_pressure"] < CAVITATES)
    third = {(r["rig"], r["frequency"], r["way"]): r["third_db"] for r in rows}
    assert all(third[rig, 5.0, "apc+ahc"] < third[rig, 5.0, "apc"] - 20 for rig in ("nominal", "mass+50"))
    assert [row["plants"] for row in metrics["plants"]] == [4, 4]
    assert all(row["within"] == 4 and row["tripped"] == 0 for row in metrics["plants"])
    reach = {row["rig"]: row["highest_hz"] for row in metrics["reach"]}
    assert reach["mass+50"] < reach["nominal"]
    said = capsys.readouterr()
    assert "10 mm up to 12.7 Hz, where the valve of mass+50 saturates" in said.err
    assert (
        "p-dp alone nowhere, p-dp APC up to 10 Hz, p-dp APC + AHC up to 10 Hz. Drawn plants: 100 % at 5 Hz" in said.out
    )


def test_a_controller_without_a_form_in_lanes_is_judged_on_the_rigs_only(folder):
    head = EXPERIMENT[: EXPERIMENT.index("[controllers")].replace("[5, 10]", "[10]").replace('"nominal", ', "")
    own = folder / "own.py"
    own.write_text(
        "from controllers.p import P\n\n"
        "class Own(P):\n"
        "    def compute(self, reference, measurement):\n"
        "        return super().compute(reference, measurement)\n"
    )
    (folder / "sines.toml").write_text(head + '[controllers.own]\nuse = "own.py:Own"\ngain = "0.1 1/m"\n')
    assert main(["sines", "sines.toml", "--out", "out/own"]) == 0
    metrics = json.loads((folder / "out/own/metrics.json").read_text())
    assert metrics["left_out"] == ["own"]
    assert metrics["plants"] == []
    assert [row["within"] for row in metrics["rows"]][:2] == [False, True]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[5, 10]", "[5, 14]", "frequencies: 14 Hz: the valve of mass+50 gives 8.27 mm there, and 10 mm up to 12.7 Hz"),
        ("[5, 10]", "[5, 0]", "frequencies: at least 0.001 Hz, and ten samples a cycle"),
        ('"10 mm"', '"300 mm"', "amplitude: beyond the stroke limit of 240 mm; lower it"),
        ("harmonics = 3", "harmonics = 2", "harmonics: the highest odd order that is taken out: 3 or 5"),
        ("stroke = 0.9", "stroke = 1.5", "stroke: a share of the stroke limit over which they are drawn, at most 1"),
        ('gain = "4 1/m"', 'gain = "4 1/m"\nstiffness = "1 kN/mm"', "controls the force; sines move the position"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(folder, capsys, old, new, says):
    (folder / "sines.toml").write_text(EXPERIMENT.replace(old, new))
    assert main(["sines", "sines.toml"]) == 2
    line = capsys.readouterr().err
    assert says in line
    assert line.count("\n") == 1
    assert not (folder / "out").exists()


def test_a_share_of_what_the_valve_gives_goes_as_far_as_is_asked(folder):
    from workbench.commands.sines.options import SinesConfig

    (folder / "sines.toml").write_text(
        EXPERIMENT.replace("frequencies = [5, 10]", "share = 0.5\nfrequencies = [2, 20]")
    )
    config = SinesConfig.load(folder / "sines.toml")
    assert config.sines[0].amplitude == 0.01
    assert config.sines[1].amplitude == pytest.approx(0.5 * config.reach["mass+50"].sine_amplitude(20.0))
