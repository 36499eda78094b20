"""Recordings without a clock, without units, with a load pressure: read by campaign.toml alone, scored by free runs."""

from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.plant import build
from workbench.records import load_campaign, read_record
from workbench.records.columns import ColumnMap
from workbench.rigs.rig import load_rig

CRANE = Path(__file__).parents[2] / "shared" / "data" / "crane" / "actuator.mat"
HEADER = "u,p,x"


def csv(folder, rows=12, header=HEADER):
    path = folder / "a.csv"
    path.write_text("\n".join([header, *(f"{0.01 * k},{k % 5 - 2},{k}" for k in range(rows))]))
    return path


def campaign(folder, text):
    (folder / "campaign.toml").write_text(text)
    return load_campaign(folder)


MAPPED = {
    "t": ColumnMap(period=2e-3),
    "command": ColumnMap("u", scale=-0.5),
    "load_pressure": ColumnMap("p", scale=10.0, to="bar", offset=1.0),
}


def test_a_period_stands_in_for_a_clock_and_to_names_the_unit_of_what_scale_and_offset_make(tmp_path):
    record = read_record(csv(tmp_path), MAPPED)
    assert record.t == pytest.approx(2e-3 * np.arange(12))
    assert record.signals["command"][10] == pytest.approx(-0.05)
    assert record.signals["load_pressure"][:2] == pytest.approx([-19e5, -9e5])
    assert record.notes == ('a.csv: not used: "x"',)


def test_an_offset_without_to_is_in_si(tmp_path):
    mapping = MAPPED | {"position": ColumnMap("x", unit="mm", offset=0.5)}
    assert read_record(csv(tmp_path), mapping).signals["position"][3] == pytest.approx(0.503)


def test_a_file_with_a_column_called_t_may_still_be_given_a_period(tmp_path):
    record = read_record(csv(tmp_path, header="u,p,t"), MAPPED)
    assert record.period == pytest.approx(2e-3)


@pytest.mark.parametrize(
    ("signals", "says"),
    [
        ('t = {period = "2 mm"}', "signals.t.period"),
        ("t = {period = 0.002}", "signals.t.period"),
        ('t = {period = "2 ms", column = "t"}', "unknown key"),
        ('t = {period = "2 ms"}\nposition = {column = "x", to = "bar"}', 'to = "bar" is no unit of position'),
        ('t = {period = "2 ms"}\nposition = {column = "x", offset = "1"}', "position.offset"),
        ("", "as a column or by its period"),
    ],
)
def test_a_mapping_that_cannot_be_is_refused(tmp_path, signals, says):
    csv(tmp_path)
    text = (
        f'rig = "crane"\n[records]\nheldout = ["a.csv"]\n[signals]\ncommand = {{column = "u", scale = 1.0}}\n{signals}'
    )
    with pytest.raises(InputError, match=says):
        campaign(tmp_path, text)


def test_a_score_is_windows_or_free_run(tmp_path):
    csv(tmp_path)
    with pytest.raises(InputError, match="free-run"):
        campaign(tmp_path, 'rig = "crane"\nscore = "free"\n[records]\nheldout = ["a.csv"]\n')


@pytest.mark.parametrize("name", ["jack-10t", "festo-tp511"])
def test_a_load_pressure_is_what_chamber_a_has_over_chamber_b(name):
    plant = build(load_rig(name))
    outputs = plant.observe(plant.start + np.arange(1, plant.n + 1) * plant.scale * 1e-2, np.zeros(len(plant.inputs)))[
        0
    ]
    a, b, load = (outputs[plant.output(signal)] for signal in ("pa", "pb", "load_pressure"))
    assert load == pytest.approx(a - b)
