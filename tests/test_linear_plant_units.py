"""Linear plants whose position is no length: their units in files, scenarios, reports and messages."""

import json

import control
import numpy as np
import pytest

import workbench as wb
from controllers import P
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.rigs.linear_rig import LinearRig
from workbench.rigs.rig_file import load_rig, rig_text

PLANT = """[chain]
gain = 4.0
integrators = 1
lags = ["20 ms"]
[signals]
command = 10.0
position = "{unit}"
[limits]
stroke = "90 {unit}"
speed = "60 {unit}/s"
[control]
period = "2 ms"
[sensors.position]
noise = "0.002 {unit}"
resolution = "0.001 {unit}"
"""
STEP = """experiment = "step"
scenarios = ["turn"]
[plant]
chain = "plant.toml"
[scenario.turn]
size = "5 {unit}"
seconds = "2 s"
[controllers.p]
use = "controllers.p:P"
gain = {{value = {gain}, unit = "1/m"}}
[bode]
low_hz = 0.5
high_hz = 5
points = 3
amplitudes_{key} = [0.1]
"""
SI = {"deg": ("rad", np.pi / 180), "N": ("N", 1.0), "degC": ("degC", 1.0), "mV": ("V", 1e-3), "rad": ("rad", 1.0)}


@pytest.fixture(params=SI)
def unit(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plant.toml").write_text(PLANT.format(unit=request.param))
    (tmp_path / "step.toml").write_text(
        STEP.format(unit=request.param, key=request.param.lower(), gain=0.05 / SI[request.param][1])
    )
    return request.param


def test_a_file_is_in_the_units_of_its_output(unit, tmp_path):
    rig, (si, factor) = load_rig("plant.toml", tmp_path), SI[unit]
    assert isinstance(rig, LinearRig)
    assert (rig.signal("position").si, rig.signal("position").unit) == (si, unit)
    assert [rig.limit("stroke"), rig.limit("speed")] == pytest.approx([90 * factor, 60 * factor])
    assert rig.sensors["position"].noise == pytest.approx(0.002 * factor)
    (tmp_path / "again.toml").write_text(rig_text(rig))
    again = load_rig("again.toml", tmp_path)
    assert again.kind == rig.kind
    assert again.limit("stroke") == pytest.approx(rig.limit("stroke"))
    assert wb.ClosedLoop(rig, P(gain=2.0)).margins().null.ms == pytest.approx(
        wb.ClosedLoop(again, P(gain=2.0)).margins().null.ms
    )


def test_steps_and_their_report_are_in_that_unit(unit, tmp_path):
    main(["run", "step.toml", "--out", "o"])
    row = json.loads((tmp_path / "o" / "metrics.json").read_text())["rows"][0]
    assert row["band"] == pytest.approx(0.02 * 5 * SI[unit][1])
    assert row["tripped"] is None
    report = (tmp_path / "o" / "report.html").read_text()
    assert f"band [{unit}]" in report
    assert "[mm]" not in report
    assert "m/s<" not in report


def test_messages_are_in_that_unit(unit, tmp_path, capsys):
    text = (tmp_path / "step.toml").read_text()
    for changed, words in (
        (text.replace('"5 ', '"120 '), f"asks for a position of 120 {unit}, the limit of plant is 90 {unit}"),
        (text.replace('"5 ', '"5 kg*'), f'cannot be converted to "{SI[unit][0]}"'),
    ):
        (tmp_path / "step.toml").write_text(changed)
        assert main(["run", "step.toml", "--out", "o"]) == 2
        assert words in capsys.readouterr().err


def test_standard_scenarios_are_of_lengths():
    plant = wb.linear_plant(control.tf([1.0], [1.0, 0.0]), "1 ms", "90 deg", position="deg")
    assert plant.limit("stroke") == pytest.approx(np.pi / 2)
    with pytest.raises(InputError, match="is a length, plant is measured in deg"):
        wb.loop.reach.check_reach(wb.SCENARIOS["position-10mm"], plant)
    assert wb.ClosedLoop(plant, P(gain=2.0)).step("5 deg", "1 s").scenario.name == "position step of 5 deg"


def test_a_quantity_that_no_loop_has_is_refused():
    with pytest.raises(InputError, match='a position in "ms": write a unit of m, or of one of rad'):
        wb.linear_plant(control.tf([1.0], [1.0, 0.0]), "1 ms", 1.0, position="ms")
