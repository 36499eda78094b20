"""The FMU of a platform: FMPy finds it valid, and it moves as the engine does."""

import shutil

import numpy as np
import pytest
from test_fmu import Slave

from workbench.cli import main
from workbench.commands.fmu.model import with_cavitation
from workbench.engine import Engine
from workbench.linear.platform_modes import platform_equilibrium
from workbench.plant.platform import build_platform
from workbench.rigs.platform import load_platform

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: the group fmu")
pytestmark = [
    pytest.mark.filterwarnings("default"),  # those of FMPy are its own
    pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler"),
]
PERIOD, STEPS = 1e-3, 60


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("platform") / "out"
    assert main(["fmu", "hexapod", "--out", str(folder)]) == 0
    return folder / "hexapod.fmu"


def test_fmpy_finds_it_valid_and_it_says_what_its_signals_are(made):
    from fmpy.validation import validate_fmu

    assert validate_fmu(made) == []
    told = {each.name: each for each in fmpy.read_model_description(made).modelVariables}
    assert (told["leg3.pa"].unit, told["roll"].unit, told["moment_x"].unit) == ("Pa", "rad", "N m")
    assert float(told["mass"].start) == load_platform("hexapod")["mass"]
    assert all(each.description for each in told.values())


def test_it_moves_as_the_engine_does(made, tmp_path):
    """Legs are driven unequally, and a wrench comes in between."""
    plant = build_platform(load_platform("hexapod"))
    about = platform_equilibrium(plant, None)
    u = np.tile(about.u, (STEPS, 1))
    u[5:, plant.input("command2")] += 0.05
    u[5:, plant.input("command5")] -= 0.03
    u[30:, plant.input("moment_y")] = 2000.0
    plant, start = with_cavitation(plant, about.x)
    expected = Engine(plant, brief=True).run(start, np.arange(STEPS + 1) * PERIOD, u).x
    slave = Slave(made, tmp_path)
    names = [f"state.{each.name}" if each.name in plant.outputs else each.name for each in plant.states]
    inputs = [variable.name for variable in plant.inputs]
    x = [slave.get(*names)]
    for k, row in enumerate(u):
        slave.set(**dict(zip(inputs, row, strict=True)))
        slave.fmu.doStep(k * PERIOD, PERIOD)
        x.append(slave.get(*names))
    assert np.ptp(expected[:, plant.state("roll")]) > 1e-5
    assert np.all(np.abs(np.array(x) - expected) <= 1e-5 * np.maximum(np.ptp(expected, axis=0), 1e-3 * plant.scale))


def test_a_controller_inside_is_refused_in_one_line(tmp_path, capsys):
    words = ["fmu", "hexapod", "--controller", "position_tuned:p-dp", "--out", str(tmp_path / "out")]
    assert main(words) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()
