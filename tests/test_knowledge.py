"""What knowing a rig is worth: ranges shrink about what is believed, and who knows more has no worse plants to fear."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.studies import kept
from experiments.studies.knowledge.__main__ import main
from experiments.studies.knowledge.config import known_problem, load_knowledge
from workbench.link.commissioning.designs import exactly
from workbench.loop import envelope
from workbench.loop.plant_lanes import uncertain
from workbench.loop.rig_variations import known_to
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
STUDIES = EXPERIMENTS / "studies" / "knowledge"
FACTORS = {"M": (0.5, 1.5), "beta": (0.5, 1.15), "Ps": (0.8, 1.03)}


@pytest.fixture(scope="module")
def rig():
    return load_rig("jack-10t")


def ranges(rig, factors):
    return {name: np.array(ends) for name, ends in uncertain(rig, build(rig), factors).items()}


def test_half_of_a_range_either_way_is_all_of_it(rig):
    declared, known = ranges(rig, FACTORS), ranges(*known_to(rig, FACTORS, 0.5))
    assert declared.keys() == known.keys() > FACTORS.keys()
    assert all(known[name] == pytest.approx(ends) for name, ends in declared.items())


def test_every_range_shrinks_in_proportion_about_what_is_believed(rig):
    declared, known = ranges(rig, FACTORS), ranges(*known_to(rig, FACTORS, 0.05))
    for name, (low, high) in known.items():
        assert low <= rig[name] <= high
        assert high - low == pytest.approx(0.1 * np.ptp(declared[name]))
    assert known["M"] == pytest.approx([950, 1050])


def test_an_exact_rig_has_ranges_of_no_width(rig):
    known, factors = known_to(rig, FACTORS, 0.0)
    assert all(np.ptp(ends) == 0 for ends in ranges(known, factors).values())
    assert ranges(exactly(rig), {}) == {}


def test_an_interval_of_a_fit_is_what_shrinks(rig):
    fitted = replace(rig, numbers={**rig.numbers, "Cl": replace(rig.numbers["Cl"], interval=(1e-12, 3e-12))})
    known, _ = known_to(fitted, {}, 0.25)
    assert ranges(known, {})["Cl"] == pytest.approx([1.5e-12, 2.5e-12])


def test_a_search_is_the_same_but_for_what_is_known():
    config = load_knowledge(STUDIES / "knowledge.toml")
    search = config.searches[0]
    start = {number.name: number.low for number in search.searched}
    problem = known_problem(search, 0.05, start)
    assert problem.factors["M"] == pytest.approx((0.95, 1.05))
    assert list(problem.rigs) == ["nominal"]
    assert [number.start for number in problem.searched] == list(start.values())
    assert (problem.weights, problem.limits) == (search.weights, search.limits)
    assert problem.scenarios == search.start.scenarios


SMALL = """
experiment = "knowledge"
known = [50, 2]
designs = 1
plants = 24
seed = 3
searches = ["tune_p_dp_notch.toml"]
"""


def test_the_same_design_fears_less_of_plants_that_are_known_better(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(envelope, "DRAWN", 40)
    (tmp_path / "tune_p_dp_notch.toml").write_text((EXPERIMENTS / "tune_p_dp_notch.toml").read_text())
    (tmp_path / "known.toml").write_text(SMALL)
    assert main([str(tmp_path / "known.toml"), "--jobs", "1", "--out", str(tmp_path / "out")]) == 0
    metrics = json.loads((tmp_path / "out/metrics.json").read_text())
    wide, narrow = metrics["rows"]
    assert [wide["known_percent"], narrow["known_percent"]] == [50, 2]
    assert wide["numbers"] == narrow["numbers"]  # a search of one design keeps the start
    for row in (wide, narrow):
        assert row["settling_p99_s"] == row["unused_p99_s"]
        assert row["times_limit"] == pytest.approx(row["settling_p99_s"] / metrics["limit_s"])
    assert narrow["settling_p99_s"] < wide["settling_p99_s"]
    assert narrow["settling_worst_s"] < wide["settling_worst_s"]
    assert narrow["ms_worst"] < wide["ms_worst"]
    assert {"p-dp-notch-50.toml", "p-dp-notch-2.toml"} <= {path.name for path in (tmp_path / "out").iterdir()}
    assert "Known to 50 %" in capsys.readouterr().out


NOTCH = '["tune_p_dp_notch.toml"]'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[50, 2]", "[60]", "known"),
        ("[50, 2]", "[5, 5]", "known"),
        ("[50, 2]", "[]", "known"),
        (NOTCH, '["tune_p_dp_notch.toml", "tune_p_dp_notch.toml"]', "searches"),
        (NOTCH, '["tune_p_dp_notch.toml", "tune_force_p_dp.toml"]', "differ in their"),
        (NOTCH, '["nowhere.toml"]', "nowhere.toml"),
        (NOTCH, '["tutorial/tune_mine.toml"]', "does not run in lanes"),
        ("designs = 1", "designs = 0", "designs"),
        ("plants = 24", "", "plants"),
        ("seed = 3", "seed = 3\nstep = 4", "step"),
    ],
)
def test_what_makes_no_study_is_refused_in_a_line(tmp_path, capsys, old, new, said):
    shutil.copytree(EXPERIMENTS, tmp_path / "there", ignore=shutil.ignore_patterns("sample"))
    path = tmp_path / "there" / "known.toml"
    path.write_text(SMALL.replace(old, new))
    assert main([str(path), "--jobs", "1", "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err.strip().splitlines()[-1]
    assert not (tmp_path / "out").exists()


PAGE = EXPERIMENTS.parent / "docs/results/knowledge.md"


def test_the_page_has_what_the_searches_left():
    metrics = kept("knowledge/knowledge").table
    rows = {(row["controller"], row["known_percent"]): row for row in metrics["rows"]}
    lines = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in PAGE.read_text().splitlines()
        if line[:1] == "|"
    ]
    heads, table = lines[0][1:], lines[2:]
    assert len(table) * len(heads) == 2 * len(rows) == 40
    for known, *cells in table:
        for head, cell in zip(heads, cells, strict=True):
            name, what = head.replace(" [s]", "").rsplit(": " if ": " in head else ", ", 1)
            row = rows[name, float(known)]
            assert cell == f"{row['settling_p99_s' if what == '99 %' else 'unused_p99_s']:.3f}"


def test_the_sentences_of_the_page_hold():
    rows = kept("knowledge/knowledge").rows
    best = {p: min((r for r in rows if r["known_percent"] == p), key=lambda r: r["settling_p99_s"]) for p in (50, 5, 2)}
    assert [best[p]["settling_p99_s"] for p in (50, 5)] == [0.109, 0.045]
    assert best[5]["settling_p50_s"] == 0.039
    assert round(best[2]["times_limit"], 1) == 1.8
    assert sum(row["unstable"] + row["tripped"] for row in rows) == 0
    assert max(row["overshoot_worst_percent"] for row in rows) < 3.3
    assert max(row["ms_worst"] for row in rows) < 2.2
    assert min(row["unused_p99_s"] for row in rows if row["known_percent"] == 5) == 0.085


def test_the_page_of_the_force_loop_has_what_its_searches_left():
    """Known to 5 %, in less than half the time, and below what was asked of all of the range."""
    rows = kept("knowledge/knowledge_force").rows
    text = PAGE.with_name("force_known.md").read_text()
    keys = ("settling_p50_s", "settling_p99_s", "settling_worst_s")
    for row in rows:
        times = " | ".join(f"{row[key]:.3f} s" for key in keys)
        rest = f"{row['overshoot_worst_percent']:.1f} % | {row['ms_worst']:.2f} | {row['unused_p99_s']:.3f} s"
        assert f"| {row['known_percent']:g} | {times} | {rest} |" in text
        assert row["unstable"] == row["tripped"] == row["hunting"] == 0
    every, known = rows
    assert known["settling_p99_s"] < 0.5 * every["settling_p99_s"] < 0.14
