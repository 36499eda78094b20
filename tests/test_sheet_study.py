"""Coverage of sheets: truths are those of formulas, a study runs, and what made intervals too narrow stays mended."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from experiments.studies import kept
from experiments.studies.sheet.__main__ import main
from workbench.commands.force_test.bench import SIZES, ForceBench
from workbench.commands.force_test.options import with_grips
from workbench.identify.acceptance.bench import TestBench as Bench
from workbench.identify.acceptance.exact import curve_lines
from workbench.identify.acceptance.force_dynamic import force_points, referenced_mass
from workbench.identify.acceptance.opening import Opening, ValveLag
from workbench.identify.acceptance.pressure import pressure_rows
from workbench.identify.acceptance.regression import Series, regress
from workbench.records import Record
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")
RESULTS = Path(__file__).parents[1] / "docs" / "results"
ROWS = kept("sheet/sheets").rows


def test_the_true_curve_has_the_declared_lands():
    found = curve_lines(RIG, np.linspace(-1, 1, 21))
    assert found["main_flow"] == pytest.approx(RIG["K3"] * RIG["z3max"] * 35e5**0.5 * 60000, rel=2e-3)
    assert found["lap"] == pytest.approx(-200 * RIG["eps"] / RIG["z3max"], rel=0.01)
    assert found["symmetry"] == pytest.approx(0, abs=1e-6)


def test_fast_sines_are_short_and_weigh_as_much_less():
    """Counted alike, the short ones decided the mass with more noise than its interval allowed for."""
    bench = ForceBench(with_grips(RIG.with_values(ks=1e7), 20.0), 1)
    found = referenced_mass(force_points([bench.sine_record(SIZES[1], 1)], RIG), None)
    assert found is not None
    mass, _ = found
    assert mass.deviation < 0.1
    assert abs(mass.value - 20) < 2.2 * mass.deviation


def test_scores_of_few_groups_allow_for_what_was_fitted_to_them():
    random, held = np.random.default_rng(2), 0
    for _ in range(200):
        x = random.standard_normal((60, 4))
        lasting = np.repeat(random.standard_normal(12), 5)  # alike within a group
        fit = regress([Series(x[:, 0] + lasting, x, 5)], np.zeros(4), np.full(4, np.inf), summed=False)
        held += abs(fit.coefficients[0] - 1) < 2.2 * fit.deviation(np.eye(4)[0])
    assert held >= 180


def test_a_load_that_lags_behind_does_not_flatten_the_pressure_gain():
    record = Bench(RIG, 0).pressure_record()
    rise = record.signals["pa"] - record.signals["pb"]
    late = np.concatenate((np.zeros(8), rise[:-8]))  # by 40 ms, on both ways
    behind = Record(record.name, record.t, {**record.signals, "pa": late, "pb": np.zeros_like(late)})
    here, there = (next(row for row in pressure_rows([r]) if row.id == "pressure_gain") for r in (record, behind))
    assert here.value is not None
    assert there.low is not None
    assert there.high is not None
    assert there.low < here.value < there.high


def test_a_slow_recording_of_the_spool_is_not_smoothed():
    """Smoothing over three rows would make their errors one, and a flow curve's intervals too narrow."""
    record = Record("valve-flow", np.arange(100) * 5e-3, {"command": np.zeros(100), "spool": np.eye(100)[50]})
    at = Opening(ValveLag(60.0, 0.8), 0.0, 1.0).of(record)
    assert np.flatnonzero(at).tolist() == [50]


def test_a_study_says_of_each_line_how_often_it_holds(tmp_path):
    out = tmp_path / "out"
    assert main(["jack-10t", "--sheets", "records", "--number", "2", "--out", str(out)]) == 0
    rows = {row["id"]: row for row in json.loads((out / "metrics.json").read_text())["rows"]}
    assert rows["flow_gain_extending"]["rigs"] == 2
    assert all(0 <= row["held"] <= row["rigs"] for row in rows.values())


@pytest.mark.parametrize("words", [["--number", "0"], ["--sheets", "none"]])
def test_bad_input_is_one_line(words, tmp_path, capsys):
    assert main(["jack-10t", *words, "--out", str(tmp_path / "out")]) == 2
    assert words[-1] in capsys.readouterr().err.strip().splitlines()[-1]


def test_the_page_states_what_the_study_found():
    page = (RESULTS / "sheets.md").read_text()
    told = re.findall(r"^\| `(\w+)` \| (\d+) \| (\d+) \| (-?[\d.]+) \| ([\d.]+) \|$", page, re.MULTILINE)
    found = [
        (row["id"], str(row["rigs"]), str(row["held"]), f"{row['bias']:.2f}", f"{row['scatter']:.2f}") for row in ROWS
    ]
    assert told == found
    for sheet in ("valve", "records", "force"):
        own = [row for row in ROWS if row["sheet"] == sheet]
        total, held = (sum(row[key] for row in own) for key in ("rigs", "held"))
        assert re.search(rf"--sheets {sheet} --number \d+` \| {total} \| {held} \|", page)


def test_no_line_that_was_drawn_often_holds_less_than_nine_times_of_ten():
    often = [row for row in ROWS if row["rigs"] >= 90]
    assert len(often) > 25
    assert all(row["held"] >= 0.9 * row["rigs"] for row in often)
    assert sum(row["held"] for row in often) >= 0.95 * sum(row["rigs"] for row in often)
