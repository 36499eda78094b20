"""The paper's eight numbers, on both rigs, through the whole study."""

from pathlib import Path

import numpy as np
import pytest

from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.run.options import load_config
from workbench.commands.run.study import run_any

EXPERIMENT = Path(__file__).parents[1] / "experiments" / "paper.toml"
PUBLISHED = {
    "pilot_100_f3db": 115,
    "pilot_100_f90": 180,
    "pilot_25_f3db": 220,
    "pilot_25_f90": 210,
    "main_100_f3db": 70,
    "main_100_f90": 73,
    "pilot_flow": 20,
    "main_flow": 600,
}


@pytest.fixture(scope="module", params=[("jack-10t", 4.0), ("jack-10t-rounded", 2.5)], ids=lambda case: case[0])
def outcome(request):
    rig, bound = request.param
    return run_any(load_config(EXPERIMENT, rig), no_checkpoint, lambda _: None), bound


def test_the_published_figures_are_met(outcome):
    found, bound = outcome
    values = {row["id"]: row["value"] for row in found.metrics["rows"]}
    assert values.keys() == PUBLISHED.keys()
    for name, published in PUBLISHED.items():
        assert abs(values[name] / published - 1) * 100 < bound, name


def test_rows_have_the_contract_s_keys(outcome):
    for row in outcome[0].metrics["rows"]:
        assert list(row) == ["id", "value", "unit", "paper", "error_percent"]
        assert row["error_percent"] == pytest.approx(100 * (row["value"] / row["paper"] - 1))


def test_pilot_corner_at_full_current_is_a_slew_limit(outcome):
    """Between 100 and 300 Hz the large sine falls at 20 dB a decade (a slew limit), the small one hardly."""
    tables = outcome[0].tables
    drop = {
        name: tables[name]["gain_db"][-1] - np.interp(100, tables[name]["f_hz"], tables[name]["gain_db"])
        for name in tables
        if "gain_db" in tables[name]
    }
    assert drop["pilot_100"] < -7.0
    assert drop["pilot_25"] > -3.0


def test_flow_curves_are_odd(outcome):
    for part in ("pilot_flow", "main_flow"):
        flow = outcome[0].tables[part]["flow_l_min"]
        np.testing.assert_allclose(flow, -flow[::-1], atol=1e-3 * flow[-1])
