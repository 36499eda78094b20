"""Comparing finished runs: rows that match, differences that add up, folders that are refused."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.base.errors import InputError
from workbench.commands.common.run_folder import metrics_json, open_run, resolved_config
from workbench.commands.compare.finished import Finished, fingerprint, load
from workbench.commands.compare.study import differences, run_compare
from workbench.report import Page, render


def finish(out, rows, tables=None, **config):
    command = {"command": "test", **config}
    with open_run(out, command) as run:
        run.finish({"rows": rows}, resolved_config(command), tables or {}, render(Page("t", "v", [])))
    return out


def step_row(controller="p", rig="jack-10t", scenario="position-10mm", **metrics):
    numbers = {"settling_s": 1.0, "ms": 2.0, "stable": True, "tripped": None}
    return {"controller": controller, "rig": rig, "scenario": scenario, **numbers, **metrics}


def step_tables(controller="p", settled=0.01):
    t, f = np.linspace(0, 1, 50), np.geomspace(0.1, 400, 30)
    response = 1 / (1 + 1j * f)
    parts = {"real": response.real, "imag": response.imag}
    linear = {f"{name}_{part}": values for name in ("closed", "sensitivity") for part, values in parts.items()}
    return {
        f"step-{controller}-position-10mm": {"t [s]": t, "position": settled * t, "command": 0 * t},
        f"sine-{controller}-1mm": {"f_hz": f, **parts},
        f"linear-{controller}": {"f_hz": f, **linear},
        "pilot_100": {"f_hz": f, "gain_db": 20 * np.log10(abs(response)), "phase_deg": np.degrees(np.angle(response))},
        "residual-steps": {"t [s]": t, "error pa [bar]": t},
    }


def run_of(name, rows, **beside):
    return Finished(name, {"rows": rows, **beside}, {}, {})


def by_metric(found):
    return {row["metric"]: row for row in found}


def test_shared_rows_give_values_difference_and_percent():
    a = run_of("a", [step_row(settling_s=1.0), step_row("tvc")])
    b = run_of("b", [step_row(settling_s=0.5), step_row("mpc")])
    (row,) = [row for row in differences([a, b]) if row["metric"] == "settling_s"]
    assert row["controller"] == "p"
    assert row["values"] == {"a": 1.0, "b": 0.5}
    assert row["difference"] == {"b": -0.5}
    assert row["percent"] == {"b": -50.0}


def test_what_does_not_exist_has_no_difference():
    found = by_metric(differences([run_of("a", [step_row(settling_s=None)]), run_of("b", [step_row(tripped="speed")])]))
    assert found["settling_s"]["difference"] == {"b": None}
    assert found["tripped"]["values"] == {"a": None, "b": "speed"}
    assert "stable" not in found


def test_a_text_that_only_tells_runs_apart_does_not_keep_rows_apart():
    a = run_of("a", [step_row(rig="jack-10t", scenario=s) for s in ("position-1mm", "position-10mm")])
    b = run_of("b", [step_row(rig="mine", scenario=s) for s in ("position-1mm", "position-10mm")])
    found = differences([a, b])
    assert {row["scenario"] for row in found} == {"position-1mm", "position-10mm"}
    assert all("rig" not in row for row in found)


def test_rows_without_texts_are_not_matched_by_their_place():
    assert differences([run_of("a", [{"x": 1}, {"x": 2}]), run_of("b", [{"x": 3}, {"x": 4}])]) == []


def test_numbers_beside_the_rows_are_compared_but_not_timing():
    found = differences([run_of("a", [], chi2=4.0, timing={"s": 1}), run_of("b", [], chi2=1.0, timing={"s": 2})])
    assert [(row["metric"], row["percent"]) for row in found] == [("chi2", {"b": -75.0})]


def test_of_three_runs_each_is_held_against_the_first_that_has_the_row():
    runs = [run_of(name, [step_row(c, ms=ms)]) for name, c, ms in (("a", "p", 1.0), ("b", "p", 2.0), ("c", "p", 4.0))]
    assert by_metric(differences(runs))["ms"]["difference"] == {"b": 1.0, "c": 3.0}


@given(st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 2), min_size=1, max_size=5))
def test_differences_change_sign_with_the_order(pairs):
    runs = [run_of(n, [{"id": str(i), "value": p[k]} for i, p in enumerate(pairs)]) for k, n in enumerate("ab")]
    there = [row["difference"]["b"] for row in differences(runs)]
    back = [row["difference"]["a"] for row in differences(runs[::-1])]
    assert there == [-value for value in back]


def test_finished_runs_are_overlaid(tmp_path):
    a = finish(tmp_path / "a", [step_row(), step_row("p-dp")], step_tables() | step_tables("p-dp"), gain=1.0)
    b = finish(tmp_path / "b", [step_row(settling_s=0.5)], step_tables(settled=0.02), gain=2.0)
    runs = load([a, b])
    outcome = run_compare(runs)
    sections = {section.title: section.items for section in outcome.page.sections}
    assert list(sections) == ["Differences", "Steps", "Bode", "Sensitivity", "Residuals"]
    (step,) = sections["Steps"]
    assert [curve.name for curve in step.panels[0].curves] == ["a: p-dp", "a: p", "b: p"]
    assert step.panels[0].curves[2].y[-1] == pytest.approx(20)  # mm
    assert [figure.title for figure in sections["Bode"]] == [
        "Closed loop by stepped sine, 1mm",
        "Closed loop, linear at null",
        "pilot_100",
    ]
    assert sections["Differences"][1].rows == [["gain", "1.0", "2.0"]]
    assert outcome.page.verdict.endswith(
        "position-10mm, p, jack-10t: settling 0.500 s in b instead of 1.000 s (-50 %, better)."
    )
    assert metrics_json(outcome.metrics) == metrics_json(run_compare(load([a, b])).metrics)
    assert fingerprint(runs).keys() == {"a", "b"}


def test_a_change_that_no_sensor_resolves_is_no_headline():
    """-555 % of 26 nm."""
    runs = [run_of(n, [step_row(steady_state_error=e, iae=1.0)]) for n, e in (("a", 4.7e-9), ("b", -2.1e-8))]
    verdict = run_compare(runs).page.verdict
    assert verdict.startswith("None of 4 numbers changes by more than 1 % from a")
    moved = [run_of(n, [step_row(steady_state_error=e)]) for n, e in (("a", 1e-5), ("b", 3e-4))]
    assert "final error 0.30 mm in b instead of 0.01 mm" in run_compare(moved).page.verdict


def test_a_loop_that_settles_in_one_run_alone_is_the_headline():
    runs = [run_of(n, [step_row(settling_s=s, ms=m)]) for n, s, m in (("a", 0.5, 2.0), ("b", None, 9.0))]
    assert "settling never in b instead of 0.500 s" in run_compare(runs).page.verdict


def test_folders_of_one_name_get_their_parents(tmp_path):
    made = [finish(tmp_path / above / "run", [step_row()]) for above in ("x", "y")]
    assert [run.name for run in load(made)] == ["x/run", "y/run"]


def test_folders_that_are_no_finished_runs_are_refused(tmp_path):
    good = finish(tmp_path / "good", [step_row()])
    (tmp_path / "foreign").mkdir()
    (tmp_path / "half.partial" / "stages").mkdir(parents=True)
    broken = finish(tmp_path / "broken", [step_row()])
    (broken / "metrics.json").write_text("{")
    listed = finish(tmp_path / "listed", [step_row()])
    (listed / "metrics.json").write_text("[1]")
    for name, words in {
        "none": "no such run folder",
        "foreign": "no run of jackbench",
        "half.partial": "unfinished run",
        "half": "unfinished run",
        "broken": "cannot be read",
        "listed": "not what jackbench writes",
    }.items():
        with pytest.raises(InputError, match=words) as caught:
            load([good, tmp_path / name])
        assert "\n" not in str(caught.value)
        assert name in str(caught.value)
    with pytest.raises(InputError, match="two or more"):
        load([good])
    with pytest.raises(InputError, match="two or more"):
        load([good, good])


def test_runs_without_anything_in_common_are_refused(tmp_path):
    a = finish(tmp_path / "a", [step_row()])
    b = finish(tmp_path / "b", [{"id": "pilot_flow", "value": 20.0}])
    with pytest.raises(InputError, match="share neither"):
        run_compare(load([a, b]))


def test_a_table_that_can_not_be_read_is_named(tmp_path):
    a, b = (finish(tmp_path / n, [step_row()], step_tables()) for n in "ab")
    (b / "pilot_100.parquet").write_bytes(b"no")
    with pytest.raises(InputError, match=r"pilot_100.parquet: no readable"):
        run_compare(load([a, b]))
