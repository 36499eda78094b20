"""`jackbench faults`: rows, false trips, a report; damage as it is counted; what the file must say."""

import json
from pathlib import Path

import numpy as np
import pytest

from workbench.cli import main
from workbench.commands.faults.fault_free import FAILED, tripped
from workbench.commands.faults.page import verdict
from workbench.loop.fault_trial import MOMENTS, damage
from workbench.loop.faults import FAULTS

EXPERIMENT = """
experiment = "faults"
rig = "jack-10t"
plants = 4
seed = 1
seconds = {value = 0.5, unit = "s"}
stroke = 0.9
[steps]
position = {value = 50, unit = "mm"}
[within]
M = [0.5, 1.5]
[from]
"position_tuned.toml" = ["p"]
"""


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faults")
    tuned = Path(__file__).parents[1] / "experiments" / "position_tuned.toml"
    (folder / "position_tuned.toml").write_text(tuned.read_text())
    (folder / "faults.toml").write_text(EXPERIMENT)
    return folder / "faults.toml"


def test_every_fault_from_every_moment_and_plants_without_one(experiment, tmp_path):
    assert main(["faults", str(experiment), "--plants", "3", "--out", str(tmp_path / "out")]) == 0
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    rows = metrics["rows"]
    assert {row["fault"] for row in rows} == {fault.name for fault in FAULTS} - {"specimen breaks"}
    assert len(rows) == (len(FAULTS) - 1) * len(MOMENTS)
    assert {"fault", "controller", "moment", "detected_ms", "stop_speed", "peak_force", "beyond_percent"} <= set(
        rows[0]
    )
    assert metrics["false_trips"] == 0
    assert metrics["plants"] == 3
    assert metrics["counts"]["played"] == len(rows)
    assert metrics["counts"]["detected"] == sum(row["detected_ms"] is not None for row in rows)
    assert metrics["counts"]["harm"] == 0
    assert all(row["tripped"] is None for row in metrics["calm"])
    for row in rows:
        if not row["fault"].startswith("valve stuck"):
            assert row["stop_speed"] <= 0.2, row
            assert row["beyond_percent"] <= 10, row
    assert "Faults on jack-10t" in (tmp_path / "out" / "report.html").read_text()


def test_damage_is_counted_at_the_stop_and_beyond_limits(rig):
    calm = dict.fromkeys(("position", "velocity", "force", "jack_force", "acceleration"), np.zeros(3))
    assert damage(calm, rig) == {"stop_speed": 0.0, "peak_force": 0.0, "beyond_percent": 0.0}
    met = calm | {"position": np.array([0.0, 0.24, 0.252]), "velocity": np.array([4.0, 3.0, -2.0])}
    met |= {"acceleration": np.array([0.0, 0.0, -100.0]), "force": np.array([0.0, 99e3, 0.0])}
    counted = damage(met, rig)
    assert counted["stop_speed"] == 2.0
    assert counted["peak_force"] == pytest.approx(100e3 + 2 * rig["b"])
    assert counted["beyond_percent"] == pytest.approx(10.0)


def test_the_verdict_sets_a_stuck_valve_apart():
    row = {"fault": "valve stuck at 0.3", "stop_speed": 2.0, "beyond_percent": 5.0, "detected_ms": None}
    saved = [{"closing_ms": 10.0, "of": 1, "harm": 0}, {"closing_ms": 20.0, "of": 1, "harm": 1}]
    rows = [row, row | {"fault": "position frozen"}]
    calm = {"false_trips": 0, "plants": 7, "trips": {"p": {}}, "left_out": []}
    words = verdict({"rows": rows, "shut_off": saved, **calm})
    assert words.startswith("2 faults: 1 meet the stop above 0.2 m/s or pass a limit by more than 10 %, besides 1 of a")
    assert "(again with a shut-off valve in its lines: one that closes in 10 ms leaves 0, 20 ms leaves 1)" in words
    assert words.endswith("0 false trips on the rig itself and on 7 plants a loop.")


def test_plants_that_no_law_was_played_on_and_that_failed_are_no_calm_plants():
    calm = {"rows": [], "shut_off": [], "false_trips": 0, "plants": 7, "trips": {}, "left_out": ["mine"]}
    assert verdict(calm).endswith("0 false trips on the rig itself; no drawn plants under mine.")
    trips = {"speed": 2, FAILED: 3}
    assert tripped(trips) == 2
    assert "3 drawn plants could not be simulated" in verdict(calm | {"trips": {"p": trips}})


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("stroke = 0.9", "stroke = 1.9", "stroke: a share of the stroke limit in which steps lie, at most 1"),
        ("plants = 4", "plans = 4", "plans"),
        ('experiment = "faults"', 'experiment = "fault"', "experiment"),
    ],
)
def test_a_file_that_says_something_else_is_refused(experiment, tmp_path, capsys, before, after, message):
    wrong = experiment.parent / "wrong.toml"
    wrong.write_text(EXPERIMENT.replace(before, after))
    assert main(["faults", str(wrong), "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err


def test_plants_are_one_or_more(experiment, capsys):
    assert main(["faults", str(experiment), "--plants", "0"]) == 2
    assert "--plants 0: must be 1 or more" in capsys.readouterr().err
