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
from test_coefficients import DITHER, LAP, SCHEDULED, SHAPING, around
from test_controllers import CONTROLLERS, EXPERIMENTS, PERIOD, make

from workbench.cli import main
from workbench.commands.run.config import load_config
from workbench.control.export import coefficients, replay
from workbench.control.export.c_code import c_code
from workbench.control.export.sections import SAMPLES, identifier
from workbench.control.export.structured_text import structured_text
from workbench.linear import equilibrium, linear_plant
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

GCC = shutil.which("gcc")
FORCE = [("force_tuned", "mpc-force")]
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]


def predictive(experiment, name):
    """A shipped predictive controller."""
    return next(spec for spec in load_config(EXPERIMENTS / f"{experiment}.toml").controllers if spec.name == name)


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
    law = coefficients(around(name, SCHEDULED, LAP, DITHER, SHAPING), PERIOD)
    done = compiled(tmp_path, f"3 {name}", law)
    assert done.returncode == 0, done.stdout


@pytest.mark.skipif(GCC is None, reason="no C compiler here")
@pytest.mark.parametrize(("experiment", "name"), [("position_mpc", "mpc"), ("position_mpc", "mpc-bare"), *FORCE])
def test_the_c_of_a_predictive_law_gives_its_vector(tmp_path, experiment, name):
    """Whole: filter, governor and plan; with and without compensators, and on a load cell. Nothing is allocated."""
    law = coefficients(predictive(experiment, name).build(PERIOD), PERIOD)
    done = compiled(tmp_path, name, law)
    assert done.returncode == 0, done.stdout
    assert "alloc" not in (tmp_path / f"{identifier(name)}.c").read_text()


@pytest.mark.skipif(GCC is None, reason="no C compiler here")
def test_the_check_in_c_notices_a_wrong_limit(tmp_path):
    law = coefficients(predictive("position_mpc", "mpc").build(PERIOD), PERIOD)
    law.planned.core.kernel.table("REACH")[:] *= 1 + 1e-4
    assert compiled(tmp_path, "mpc", law).returncode == 1


def test_the_structured_text_of_a_predictive_law_gives_its_vector():
    """Of a short horizon: the grammar takes its time."""
    spec = predictive("position_mpc", "mpc")
    small = replace(spec, design=replace(spec.design, horizon=5e-3, moves=2))
    law = coefficients(small.build(PERIOD), PERIOD)
    few = replace(law, vector={name: values[:4] for name, values in law.vector.items()})
    units = units_of(structured_text("mpc", few)["mpc.st"])
    block, command = Instance(units["mpc"], units), []
    for k in range(SAMPLES // 4 + 20):
        signals = {name: float(law.vector[name][k]) for name in law.signals[1:]}
        block(restart=k == 0, setpoint=float(law.vector["reference"][k]), **signals)
        command.append(block.values["command"])
    assert np.abs(np.diff(command)).max() > 0.15  # the plan had work
    assert command == pytest.approx(law.vector["command"][: len(command)], abs=1e-9)


@pytest.mark.skipif(GCC is None, reason="no C compiler here")
def test_the_check_in_c_notices_a_wrong_coefficient(tmp_path):
    law = coefficients(make("pid-lead"), PERIOD)
    first = law.channels[0]
    bent = first.sections.copy()
    bent[0, 0] *= 1 + 1e-6
    wrong = replace(law, channels=(replace(first, sections=bent), *law.channels[1:]))
    assert compiled(tmp_path, "pid-lead", wrong).returncode == 1


@pytest.fixture(scope="module")
def resting():
    """A law with a schedule over low-passes, whose outputs count at rest, a map, and a dither."""
    law = coefficients(around("p", SCHEDULED, LAP, DITHER), PERIOD)
    low_pass = np.array([[1e-10, 1e-10, 0.0, 1.0, -0.8, 0.0]])  # of a step 1e-10 at once, 1e-9 at last
    law = replace(law, channels=tuple(replace(c, sections=low_pass) if c.scale else c for c in law.channels))
    return replace(law, vector={**law.vector, "command": replay(law)})


@pytest.fixture(scope="module")
def units(resting):
    """Its Structured Text through the grammar of another project, which takes its time."""
    few = replace(resting, vector={name: values[:4] for name, values in resting.vector.items()})
    return units_of(structured_text("p-dp", few)["p_dp.st"])


def test_the_structured_text_of_a_law_gives_its_vector(resting, units):
    """A law with sections from several signals, a schedule, a map and a dither."""
    block, vector = Instance(units["p_dp"], units), resting.vector
    command = []
    for k in range(200):
        signals = {name: float(vector[name][k]) for name in resting.signals[1:]}
        block(restart=k == 0, setpoint=float(vector["reference"][k]), **signals)
        command.append(block.values["command"])
    assert command == pytest.approx(vector["command"], abs=1e-9 * np.abs(vector["command"]).max())
    check = Instance(units["p_dp_check"], units)
    for _ in range(5):
        check()
    assert check.values["done"]
    assert check.values["passed"]


REST = {"position": 0.21, "pa": 8e6, "pb": 5e6}
MOVED = {"position": 0.23, "pa": 8.1e6, "pb": 5e6}
HELD = 2e-3


def started(law):
    """A law's commands: two at rest, and one where position and pressure have moved and the reference has not."""
    gain, factor = law.channels[0].sections[0, 0], law.channels[1].scale
    still = 1e-9 * (REST["pa"] + REST["pb"])
    at_once = 1e-10 * (MOVED["pa"] - REST["pa"])
    total = HELD + law.command_map.back(HELD) - still * factor(REST["position"])
    total += gain * (REST["position"] - MOVED["position"]) + (still + at_once) * factor(MOVED["position"])
    commands = [HELD, HELD, total + law.command_map.shift(total)]
    return [a + b for a, b in zip(commands, law.sine.samples(3), strict=True)]


@pytest.mark.skipif(GCC is None, reason="no C compiler here")
def test_the_c_of_a_law_starts_without_a_bump(tmp_path, resting):
    for file, text in c_code("law", resting).items():
        (tmp_path / file).write_text(text)
    rest, moved = (", ".join(str(signals[name]) for name in resting.signals[1:]) for signals in (REST, MOVED))
    steps = "".join(f'printf("%.17g ", law_step(&s, {REST["position"]}, {at}));' for at in (rest, rest, moved))
    body = f"law_state s; law_start(&s, {HELD}, {rest}); {steps} return 0;"
    program, main_c = tmp_path / "program", tmp_path / "main.c"
    main_c.write_text(f'#include <stdio.h>\n#include "law.h"\nint main(void) {{ {body} }}\n')
    subprocess.run([GCC, *STRICT, str(main_c), str(tmp_path / "law.c"), "-o", str(program)], check=True)
    printed = subprocess.run([program], check=True, capture_output=True, text=True).stdout.split()
    assert [float(word) for word in printed] == pytest.approx(started(resting), abs=1e-12)


def test_the_structured_text_of_a_law_starts_without_a_bump(resting, units):
    block, command = Instance(units["p_dp"], units), []
    for k, signals in enumerate((REST, REST, MOVED)):
        block(start=k == 0, held=HELD, setpoint=REST["position"], **signals)
        command.append(block.values["command"])
    assert command == pytest.approx(started(resting), abs=1e-12)


def test_the_folder_holds_every_law_that_can_be_exported(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["coefficients", "force_tuned", "--out", "laws"]) == 0
    assert "p-dp-force, mpc-force as" in capsys.readouterr().out
    whole = {"plant.mat", "link_main.c", "link_laws.h"}
    endings = {".json", ".c", ".h", ".st", ".mat"}
    assert {path.name for path in (tmp_path / "laws").iterdir()} == {
        *whole,
        *(f"{name}{end}" for name in ("p_dp_force", "mpc_force") for end in endings),
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
