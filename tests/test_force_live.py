"""A load cell's sheet of a live rig: what `excite` designs is recorded through the link, and the mass comes back."""

import json
from dataclasses import replace

import pytest
from made_links import at, served

from workbench.cli import main
from workbench.commands.force_test.bench import SIZES, ForceBench
from workbench.commands.force_test.options import with_grips
from workbench.link.bench import bench
from workbench.records.excitation import excitation_text
from workbench.rigs.rig_file import load_rig, rig_text
from workbench.rigs.sensor import Sensor

MASS = 20.0  # kg


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """The folder of a rig with a specimen, grips and a reference cell, its file, and sines of force that were recorded
    of it behind the link."""
    folder, jack = tmp_path_factory.mktemp("lab"), load_rig("jack-10t").with_values(ks=1e7)
    rig = with_grips(replace(jack, sensors={**jack.sensors, "reference_force": Sensor(10.0, 1.0)}), MASS)
    (folder / "lab.toml").write_text(rig_text(rig))
    wave = ForceBench(rig, 0).sine_wave(SIZES[1])
    (folder / f"{wave.name}.csv").write_text(excitation_text(wave))
    with served(bench(rig, True, False)) as server:
        played = ["--at", at(server), "--play", str(folder / f"{wave.name}.csv")]
        assert main(["record", str(folder / "lab.toml"), *played, "--out", str(folder / "live")]) == 0
    return folder


def test_records_of_a_live_rig_tell_the_mass_between_cell_and_specimen(lab):
    assert main(["force-test", str(lab / "live"), "--out", str(lab / "sheet")]) == 0
    rows = {row["id"]: row for row in json.loads((lab / "sheet" / "metrics.json").read_text())["rows"]}
    assert rows["mass"]["low"] < MASS < rows["mass"]["high"]
    assert rows["dynamic_error_10hz_sine_30"]["value"] == pytest.approx(-0.8, abs=0.05)  # of the range: m w^2 / k
    assert rows["static_error"]["reason"].startswith("no record force-static")


def test_a_plan_says_that_levels_are_missing(lab, capsys):
    assert main(["plan", str(lab / "live"), "--for", "force-test", "--out", str(lab / "plan")]) == 0
    missing = json.loads((lab / "plan" / "metrics.json").read_text())["missing"]
    assert [row["record"] for row in missing] == ["force-static"]
    assert (lab / "plan" / "force-static.csv").exists()


@pytest.mark.parametrize("words", [["excite", "jack-10t", "force-test"], ["excite", "hexapod", "force-test"]])
def test_a_rig_without_a_specimen_is_one_line(words, tmp_path, capsys):
    assert main([*words, "--out", str(tmp_path / "x")]) == 2
    told = capsys.readouterr().err.strip()
    assert words[1] in told
    assert "\n" not in told
    assert not list(tmp_path.iterdir())
