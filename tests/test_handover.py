"""Laws handed over: C and Structured Text do what the controller does, .mat files are the linear models."""

import json
import shutil
import subprocess
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.io import loadmat
from structured_text import Instance, units_of
from test_coefficients import LAP, SCHEDULED, SHAPING, around
from test_controllers import CONTROLLERS, PERIOD, make

from workbench.cli import main
from workbench.control.export import coefficients
from workbench.control.export.c_code import c_code
from workbench.control.export.sections import identifier
from workbench.control.export.structured_text import structured_text
from workbench.linear import equilibrium, linear_plant
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

GCC = shutil.which("gcc")
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]


def compiled(folder, name, law):
    """The status and the words of the program that checks a law."""
    for file, text in c_code(name, law).items():
        (folder / file).write_text(text)
    program, plain = folder / "check", identifier(name)
    source = [f"-DCHECK_{plain.upper()}", str(folder / f"{plain}.c"), "-o", str(program), "-lm"]
    subprocess.run([GCC, *STRICT, *source], check=True)
    return subprocess.run([program], check=False, capture_output=True, text=True)


@pytest.mark.skipif(GCC is None, reason="no C compiler here")
@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_c_of_a_law_gives_its_vector(tmp_path, name):
    law = coefficients(around(name, SCHEDULED, LAP, SHAPING), PERIOD)
    done = compiled(tmp_path, f"3 {name}", law)
    assert done.returncode == 0, done.stdout


@pytest.mark.skipif(GCC is None, reason="no C compiler here")
def test_the_check_in_c_notices_a_wrong_coefficient(tmp_path):
    law = coefficients(make("pid-lead"), PERIOD)
    first = law.channels[0]
    bent = first.sections.copy()
    bent[0, 0] *= 1 + 1e-6
    wrong = replace(law, channels=(replace(first, sections=bent), *law.channels[1:]))
    assert compiled(tmp_path, "pid-lead", wrong).returncode == 1


def test_the_structured_text_of_a_law_gives_its_vector():
    """A law with sections from several signals, a schedule and a map, through the grammar of another project."""
    law = coefficients(around("p", SCHEDULED, LAP), PERIOD)
    expected = law.vector["command"]
    few = replace(law, vector={name: values[:4] for name, values in law.vector.items()})  # the grammar takes its time
    text = structured_text("p-dp", few)
    units = units_of(text["p_dp.st"])
    block = Instance(units["p_dp"], units)
    command = []
    for k in range(200):
        signals = {name: float(law.vector[name][k]) for name in law.signals[1:]}
        block(restart=k == 0, setpoint=float(law.vector["reference"][k]), **signals)
        command.append(block.values["command"])
    assert command == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    check = Instance(units["p_dp_check"], units)
    for _ in range(5):
        check()
    assert check.values["done"]
    assert check.values["passed"]


def test_the_folder_holds_every_law_that_can_be_exported(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["coefficients", "force_tuned", "--out", "laws"]) == 0
    told = capsys.readouterr()
    assert "mpc-force" in told.err
    assert "p-dp-force" in told.out
    endings = {".json", ".c", ".h", ".st", ".mat"}
    assert {path.name for path in (tmp_path / "laws").iterdir()} == {
        "plant.mat",
        *(f"p_dp_force{end}" for end in endings),
    }
    printed = json.loads((tmp_path / "laws" / "p_dp_force.json").read_text())
    assert printed["period_s"] == load_rig("jack-10t").period.value
    assert main(["coefficients", "force_tuned", "--out", "laws"]) == 2
    assert "exists already" in capsys.readouterr().err


def test_the_plant_s_mat_is_its_linear_model(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["coefficients", "position_tuned", "--controller", "p", "--out", "laws"]) == 0
    m = loadmat(tmp_path / "laws" / "plant.mat")
    outputs = [str(cell[0][0]) for cell in m["OutputName"]]
    model = control.ss(m["A"], m["B"], m["C"], m["D"], m["Ts"].item())
    plant = build(load_rig("jack-10t"))
    smooth = plant.without_dry_friction()
    ours = linear_plant(plant, equilibrium(plant, p=smooth), ("command",), tuple(outputs), smooth)
    assert "position" in outputs
    s = 2j * np.pi * np.array([0.3, 30.0, 300.0])
    np.testing.assert_allclose(model(s), ours(s, squeeze=False), rtol=1e-12)
    law = loadmat(tmp_path / "laws" / "p.mat")
    assert law["Ts"].item() == load_rig("jack-10t").period.value
    assert [str(cell[0][0]) for cell in law["InputName"]] == ["reference", "position"]
