"""Step metrics against analytic responses; a number that does not exist is None."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.base.signals import SIGNALS
from workbench.commands.common.judged import gas_words
from workbench.commands.common.metric_table import MetricView
from workbench.loop import step_metrics as metrics
from workbench.loop.metrics import METRICS, chamber_row, metric
from workbench.loop.scenarios import Limits
from workbench.loop.tuning.problem import USUAL_WEIGHTS, weight_unit

ROOT = Path(__file__).parents[1]
CONTRACT = ROOT.parent / "shared" / "contract.md"
TEXTS = {
    "controller",
    "rig",
    "scenario",
    "fault",
    "moment",
    "id",
    "unit",
    "paper",
    "worst",
    "cross",
    "record",
    "signal",
}

DT = 1e-4
T = np.arange(30001) * DT  # 3 s


def first_order(tau, before=0.0, target=1.0):
    return before + (target - before) * (1 - np.exp(-T / tau))


def second_order(w, zeta, before=0.0, target=1.0):
    wd = w * np.sqrt(1 - zeta**2)
    ring = np.exp(-zeta * w * T) * (np.cos(wd * T) + zeta * w / wd * np.sin(wd * T))
    return before + (target - before) * (1 - ring)


steps = st.tuples(st.floats(-2, 2), st.floats(0.01, 3), st.sampled_from([-1, 1]))


@given(tau=st.floats(0.02, 0.3), step=steps, band=st.sampled_from([0.01, 0.02, 0.05]))
def test_first_order(tau, step, band):
    before, size, sign = step
    target = before + sign * size
    y = first_order(tau, before, target)
    assert metrics.settling_time(T, y, target, band * size) == pytest.approx(-tau * np.log(band), abs=2 * DT)
    assert metrics.rise_time(T, y, before, target) == pytest.approx(tau * np.log(9), abs=2 * DT)
    assert metrics.overshoot(y, before, target) == pytest.approx(0.0, abs=1e-9)
    assert metrics.iae(T, y, target) == pytest.approx(size * tau * (1 - np.exp(-3 / tau)), rel=1e-3)
    mean_error = sign * size * tau / 0.3 * (np.exp(-2.7 / tau) - np.exp(-3.0 / tau))
    assert metrics.steady_state_error(T, y, target) == pytest.approx(mean_error, rel=1e-2, abs=1e-9)


@given(w=st.floats(15, 80), zeta=st.floats(0.2, 0.8), step=steps)
def test_second_order(w, zeta, step):
    before, size, sign = step
    target = before + sign * size
    y = second_order(w, zeta, before, target)
    peak = 100 * np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2))
    assert metrics.overshoot(y, before, target) == pytest.approx(peak, rel=1e-3)
    settled = metrics.settling_time(T, y, target, 0.02 * size)
    assert settled is not None
    outside = np.abs(y - target) > 0.02 * size
    assert not outside[np.round(settled / DT).astype(int) :].any()
    assert outside[round(settled / DT) - 1]
    assert settled <= -np.log(0.02 * np.sqrt(1 - zeta**2)) / (zeta * w) + DT  # the envelope
    assert metrics.steady_state_error(T, y, target) == pytest.approx(0, abs=1e-3 * size)


def test_rise_time_of_a_second_order_response():
    assert metrics.rise_time(T, second_order(10.0, 0.5), 0, 1) == pytest.approx(0.1639, abs=5e-4)


def test_time_counts_from_the_start_of_the_record():
    y = first_order(0.1)
    assert metrics.settling_time(T + 7, y, 1, 0.02) == pytest.approx(metrics.settling_time(T, y, 1, 0.02))
    assert metrics.rise_time(T + 7, y, 0, 1) == pytest.approx(metrics.rise_time(T, y, 0, 1))


def test_a_response_inside_the_band_from_the_start_settles_at_once():
    assert metrics.settling_time(T, np.full(T.size, 1.005), 1, 0.02) == 0.0


def test_what_does_not_settle_has_no_settling_time():
    for y in (first_order(2.0), 1 + 0.1 * np.sin(9 * T), np.zeros(T.size), 1 + 0.05 * (T > 2.9)):
        assert metrics.settling_time(T, y, 1, 0.02) is None
    late = np.where(T < 2.75, 0.0, 1.0)  # in the band only within the last 0.3 s: not seen to have settled
    assert metrics.settling_time(T, late, 1, 0.02) is None
    assert metrics.settling_time(T, np.where(T < 2.6, 0.0, 1.0), 1, 0.02) == pytest.approx(2.6, abs=2 * DT)


def test_what_does_not_rise_has_no_rise_time():
    assert metrics.rise_time(T, 0.89 * first_order(0.1), 0, 1) is None
    assert metrics.rise_time(T, -first_order(0.1), 0, 1) is None
    assert metrics.rise_time(T, 0.91 * first_order(0.1), 0, 1) is not None


def test_overshoot_of_a_step_downwards():
    y = np.array([1.0, 0.0, -0.2, 0.1])
    assert metrics.overshoot(y, 1.0, 0.0) == pytest.approx(20)
    assert metrics.overshoot(y, 1.0, -0.5) == 0.0


def test_a_peak_deviation_is_on_either_side():
    assert metrics.peak_deviation(np.array([1.0, 1.2, 0.7, 1.0]), 1.0) == pytest.approx(0.3)


def test_steady_state_error_has_the_sign_of_what_is_missing():
    assert metrics.steady_state_error(T, np.full(T.size, 0.9), 1.0) == pytest.approx(0.1)
    early = np.where(T < 2.69, 50.0, 0.9)
    assert metrics.steady_state_error(T, early, 1.0) == pytest.approx(0.1)


@given(a=st.floats(1e-4, 0.5), f=st.floats(30, 100), slope=st.floats(-1, 1), step=st.sampled_from([-2.0, 0.5, 1.0]))
def test_residual_oscillation_is_peak_to_peak_without_the_drift(a, f, slope, step):
    y = step + a * np.sin(2 * np.pi * f * T) + slope * T + 40 * (T < 2.69)  # what was before does not count
    assert metrics.residual_oscillation(T, y, step) == pytest.approx(2 * a / abs(step), rel=0.1)
    assert metrics.residual_oscillation(T, step + slope * T, step) == pytest.approx(0, abs=1e-9)


def test_saturated_and_cavitation_times_count_samples():
    t = np.arange(10) * 2e-3
    demanded = np.array([0.0, 2, 2, 2, 0.5, 0.1, 0, 0, np.nan, 0])
    realised = np.array([0.0, 1, 1, 1, 0.5, 0.1, 0, 1e-12, 0, 0])
    assert metrics.saturated_time(t, demanded, realised) == pytest.approx(4 * 2e-3)
    lowest = np.array([2, 0.9, 0, 0.1, 2, 2, 2, 0.99, 2, 2]) * 1e5
    assert metrics.cavitation_time(t, lowest) == pytest.approx(4 * 2e-3)


def test_cavitation_is_as_long_on_uneven_times():
    """A pressure under the line from 0.3 to 0.7 s, seen twice as often in the first half as in the second."""
    t = np.append(np.arange(0, 500) * 1e-3, 0.5 + np.arange(0, 251) * 2e-3)
    lowest = np.where((t > 0.3) & (t < 0.7), 0.5e5, 3e5)
    assert metrics.cavitation_time(t, lowest) == pytest.approx(0.4, abs=2.1e-3)
    assert chamber_row(t, lowest) == {"cavitation_s": metrics.cavitation_time(t, lowest), "lowest_pressure_bar": 0.5}
    assert set(chamber_row(t, None).values()) == {None}


def test_a_report_says_where_oil_cavitates_the_longest_first():
    calm = {"scenario": "step", "controller": "p", "rig": "light", "cavitation_s": 0.0, "lowest_pressure_bar": 40.0}
    short = {**calm, "rig": "heavy", "cavitation_s": 0.004, "lowest_pressure_bar": 0.31}
    longest = {**short, "scenario": "jump", "cavitation_s": 0.0127, "lowest_pressure_bar": 0.043}
    linear = {**calm, "cavitation_s": None, "lowest_pressure_bar": None}
    assert gas_words([calm, linear]) == gas_words([]) == ""
    said = gas_words([calm, short, longest, linear])
    assert "jump with p on heavy, for 12.7 ms and down to 0.043 bar absolute, and for less long in 1 other run." in said
    assert "other" not in gas_words([calm, longest])
    sine = {"frequency": 12.5, "cavitation_s": 0.1, "lowest_pressure_bar": 0.02}
    assert ": a sine of 12.5 Hz, for 100 ms and down to 0.02 bar absolute." in gas_words([sine])
    named = {key: each for key, each in longest.items() if key not in ("scenario", "controller")}
    assert ": iteration 3 on heavy, for" in gas_words([{**named, "iteration": 3}])
    assert ": the record on heavy, for" in gas_words([named])


def test_a_record_shorter_than_the_rest_it_must_show_does_not_settle():
    short = T < 0.2
    assert metrics.settling_time(T[short], first_order(0.01)[short], 1, 0.02) is None


def test_every_metric_has_a_unit_that_can_be_shown_and_a_meaning():
    for key, of in METRICS.items():
        assert of.key == key
        assert of.name
        assert of.meaning
        unit, factor = of.read_in(SIGNALS["force"])
        assert factor > 0
        assert of.head(SIGNALS["force"]) == (f"{of.name} [{unit}]" if unit else of.name)


def test_a_metric_is_shown_in_the_unit_of_the_signal_to_what_the_sensor_resolves():
    view = MetricView(SIGNALS["force"], resolution=10.0, period=1e-3, sizes={"a": 20e3})
    row = {
        "scenario": "a",
        "settling_s": 0.12345,
        "overshoot_percent": 1.23456,
        "iae": 2345.6,
        "peak_deviation": 1234.0,
    }
    table = view.table("", [row], row, best=("settling_s",))
    assert list(table.columns) == ["scenario", "settling [s]", "overshoot [%]", "IAE [kN s]", "peak deviation [kN]"]
    assert [str(cell) for cell in table.rows[0]] == ["a", "0.123", "1.23", "2.346", "1.23"]
    assert table.best == {"settling [s]": "min"}


def test_what_a_search_limits_and_adds_up_is_named_by_metrics():
    limited = {entry.name for entry in fields(Limits)} - {"seconds", "moves"}
    assert {key: of.better for key in limited if (of := metric(key))}.keys() == limited
    assert all(METRICS[key].better == "less" for key in USUAL_WEIGHTS)  # a cost is made small
    units = {"settling_s": "1/s", "iae": "1/s", "overshoot_percent": "1/%", "ms": "1"}
    assert {key: weight_unit(key) for key in USUAL_WEIGHTS} == units


@pytest.mark.parametrize(
    ("key", "head"),
    [
        ("settling_p99_s", "settling, 99 % [s]"),
        ("overshoot_worst_percent", "overshoot, worst [%]"),
        ("gain_margin_worst_db", "gain margin, worst [dB]"),
        ("settling_s_most", "settling, most [s]"),
    ],
)
def test_a_statistic_over_plants_is_of_its_metric(key, head):
    assert MetricView().head(key) == head


def test_what_is_no_metric_is_none():
    assert metric("worst") is None
    assert metric("settling_p42_s") is None


@pytest.mark.skipif(not CONTRACT.exists(), reason="the contract lies outside this repository")
def test_every_metric_of_the_contract_s_rows_is_declared():
    rows = [
        line
        for line in CONTRACT.read_text().splitlines()
        if re.match(r"\| `jackbench (run|robust|limit|faults|res)", line)
    ]
    keys = {
        key
        for line in rows
        for part in re.findall(r"`rows`: (.*?)\]", line)
        for key in re.findall(r'"([a-z]\w*)"', part)
    }
    assert {"settling_s", "limit_s", "detected_ms", "overshoot_worst_percent", "ratio"} <= keys
    assert [key for key in sorted(keys - TEXTS) if metric(key) is None] == []


NEW = """    Metric("swing", "largest swing", SIGNAL, "less", "largest less least of the signal", SENSOR,
           lambda run: float(np.ptp(run.y))),
"""
USER = """
import json, sys
sys.path.insert(0, "docs")
import workbench as wb
from controllers import P
from generate.metrics import pages
from workbench.commands.common.judged import gas_words
from workbench.commands.common.metric_table import MetricView
from workbench.commands.compare.study import compared

run = wb.ClosedLoop(wb.load_rig("jack-10t"), P(gain="3.7 1/m")).step("10 mm")
row = dict(run.metrics)
told = compared({"metric": "swing", "scenario": "position-10mm"})
print(json.dumps({
    "keys": list(row),
    "swing": row["swing"],
    "head": MetricView().table("", [row], ["swing"]).columns[0],
    "worst": MetricView().head("swing_worst"),
    "compare": [told.name, told.unit, told.judged(-1e-3)],
    "reference": "`swing` | largest swing |" in pages()["metrics.md"],
}))
"""


def test_a_new_metric_is_one_entry_of_one_file(tmp_path):
    for name in ("workbench", "controllers", "docs/generate"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    table, before = tmp_path / "workbench/loop/metrics.py", '    Metric("rise_s"'
    table.write_text(table.read_text().replace(before, NEW + before))
    (tmp_path / "user.py").write_text(USER)
    there = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (tmp_path, ROOT / ".ci")))}
    done = subprocess.run(
        [sys.executable, "user.py"], cwd=tmp_path, env=there, capture_output=True, text=True, check=True
    )
    said = json.loads(done.stdout)
    assert said["keys"].index("swing") == said["keys"].index("rise_s") - 1
    assert 9e-3 < said["swing"] < 20e-3
    assert (said["head"], said["worst"]) == ("largest swing [mm]", "largest swing, worst [mm]")
    assert said["compare"] == ["largest swing", "mm", "better"]
    assert said["reference"]
