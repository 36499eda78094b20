"""The five recordings that no sheet is made of, through the command line: one line, status 2, nothing left behind."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from workbench.cli import main
from workbench.commands.force_test.bench import ForceBench
from workbench.identify.acceptance.opening import ValveLag
from workbench.records import Record, write_csv
from workbench.rigs.rig_file import load_rig

T = np.arange(3000) * 1e-3
COMMAND = np.sin(T / 0.3)


def record(name, command, **signals):
    return Record(name, T[: command.size], {"command": command, **signals})


def varying_supply():
    return record("valve-flow", COMMAND, flow=0.01 * COMMAND, supply=210e5 * (1 - 0.1 * np.abs(COMMAND)))


def flow_in_another_unit():
    return record("valve-flow", COMMAND, flow=600 * COMMAND)


def short_dwell():
    command = np.where(np.arange(400) // 100 % 2 == 1, 0.5, 0.0)
    return record("valve-step-50", command, spool=2.29e-3 * ValveLag(5.0, 1.0).applied(command, 1e-3))


def no_sine():
    wave = np.where(T > 0.5, 0.2 * (2 / np.pi) * np.arcsin(np.sin(20 * np.pi * T)), 0.0)
    return record("valve-sine-25", wave, spool=2.29e-3 * wave)


def square_wave():
    wave = np.where(T > 0.5, 0.2 * np.sign(np.sin(20 * np.pi * T + 0.1)), 0.0)
    return record("valve-sine-25", wave, spool=2.29e-3 * wave)


def slow_reference():
    sines = ForceBench(load_rig("jack-10t").with_values(ks=1e7), 3).sine_record(0.3, 0)
    share = 1 - np.exp(-2 * np.pi * 30 * sines.period)  # a lag of 30 Hz
    slow = lfilter([share], [1, share - 1], sines.signals["reference_force"])
    return replace(sines, name="force-sine-30", signals={**sines.signals, "reference_force": slow})


@pytest.mark.parametrize(
    ("command", "make", "told"),
    [
        ("valve-test", varying_supply, "the supply varies"),
        ("valve-test", flow_in_another_unit, "were it in l/min it would fit"),
        ("valve-test", short_dwell, "too short"),
        ("valve-test", no_sine, "is no sine"),
        ("valve-test", square_wave, "no sine in it: the command goes by jumps"),
        ("force-test", slow_reference, "slower than the rig"),
    ],
)
def test_a_recording_that_no_sheet_is_made_of_is_one_line(command, make, told, tmp_path, capsys):
    bad = make()
    write_csv(bad, tmp_path / f"{bad.name}.csv")
    (tmp_path / "campaign.toml").write_text(f'rig = "jack-10t"\n[records]\nheldout = ["{bad.name}.csv"]\n')
    assert main([command, str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("jackbench:")]
    assert len(lines) == 1
    assert told in lines[0]
    assert bad.name in lines[0]
    assert not list(tmp_path.glob("out*"))
