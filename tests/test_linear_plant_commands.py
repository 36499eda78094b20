"""Every command that takes an experiment on two plants of a user's own: type 0, and an integrator with two modes."""

import json

import pytest

from workbench.cli import main

REST = '[signals]\ncommand = 10.0\nposition = "mm"\n{}\n[limits]\nstroke = "200 mm"\n[control]\nperiod = "2 ms"\n'
PLANTS = {
    "transfer_function": "[transfer_function]\n"
    "numerator = [600.0]\ndenominator = [1.0, 45.0, 200.0]\n" + REST.format(""),
    "chain": '[chain]\ngain = 30.0\nintegrators = 1\n'
    'modes = [{frequency = "12 Hz", damping = {value = 0.1, unit = "1"}},'
    '{frequency = "35 Hz", damping = {value = 0.05, unit = "1"}}]\n'
    + REST.format('delay = "2 ms"') + "[bounds]\ngain = [20, 40]\n",
}  # fmt: skip
LQG = '[controllers.lqg]\nuse = "controllers.linear_lqg:LinearLqg"\nerror = {value = 20, unit = "mm"}\n'
RECORD = """rigs = ["nominal", "weak"]
scenarios = ["road"]
rest = {value = 0.2, unit = "s"}
fade = {value = 0.5, unit = "s"}
[variation.weak]
factors = {gain = 0.8}
[scenario.road]
seconds = {value = 1.5, unit = "s"}
[scenario.road.road]
class = "A"
speed = {value = 10, unit = "m/s"}
low = {value = 0.5, unit = "Hz"}
high = {value = 2, unit = "Hz"}
seed = 1
"""
INVERSE = """designed_on = ["nominal"]
preview = {value = 60, unit = "ms"}
length = {value = 200, unit = "ms"}
band = {value = 2, unit = "Hz"}
"""


@pytest.fixture(params=PLANTS)
def written(request, tmp_path, monkeypatch):
    """Writes an experiment's file on a plant; its folder is the working one."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plant.toml").write_text(PLANTS[request.param])

    def write(kind, text):
        plant = f'[plant]\n{request.param} = "plant.toml"\n'
        (tmp_path / f"{kind}.toml").write_text(f'experiment = "{kind}"\n{text}{plant}{LQG}')
        return f"{kind}.toml"

    return write


def metrics(tmp_path):
    return json.loads((tmp_path / "o" / "metrics.json").read_text())


def test_show_says_poles_gain_and_delay(written, tmp_path, capsys):
    main(["show", "plant.toml", "--json"])
    derived = {row["name"]: row["value"] for row in json.loads(capsys.readouterr().out)["derived"]}
    integrating = "mode" in derived
    assert derived["integrators"] == integrating
    assert derived["gain at full command"] == pytest.approx(300.0 if integrating else 30.0, rel=1e-3)
    assert derived["delay"] == pytest.approx(2.0 if integrating else 0.0)


def test_spread_and_coefficients(written, capsys):
    bode = "[bode]\nlow_hz = 0.5\nhigh_hz = 20\npoints = 3\namplitudes_mm = [1]\n"
    file = written("step", f'scenarios = ["position-10mm"]\n{bode}')
    main(["spread", file, "--json"])
    spread = json.loads(capsys.readouterr().out)["lqg"]
    assert spread["gain"]["x1"] < 20
    main(["coefficients", file, "--json"])
    assert "lqg" in capsys.readouterr().out


def test_times_leave_an_experiment_that_loads(written, tmp_path):
    bode = "[bode]\nlow_hz = 0.5\nhigh_hz = 20\npoints = 3\namplitudes_mm = [1]\n"
    main(["time", written("step", f'scenarios = ["position-10mm"]\n{bode}'), "--out", "o"])
    from workbench.commands.common.step_experiment import load_steps

    assert load_steps(tmp_path / "o" / "timed.toml").controllers[0].name == "lqg"


def test_an_inverse_brings_the_error_down(written, tmp_path):
    main(["inverse", written("inverse", INVERSE + RECORD), "--out", "o"])
    assert min(row["factor"] for row in metrics(tmp_path)["rows"]) > 2


def test_a_drive_file_is_learned(written, tmp_path):
    main(["learn", written("learn", "iterations = 2\n" + RECORD), "--out", "o"])
    keys = "cavitation_s", "lowest_pressure_bar", "lowest_pressure"
    assert all(row[key] is None for row in metrics(tmp_path)["rows"] for key in keys)
