"""What the command line can do, Python can: a function with each command's name and options, and with its answer."""

import json
from inspect import signature

import pytest

import workbench as wb
from controllers import P, PressureFeedback
from workbench.cli import main
from workbench.commands import COMMANDS, GROUPS, folder
from workbench.notebook.commands import FUNCTIONS

OF_A_SHELL = {*GROUPS["start"], "serve", "live"}
LAW = P(gain=3.7) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz")


@pytest.fixture(scope="module")
def loop():
    return wb.ClosedLoop(wb.load_rig("jack-10t").with_values(M=900), LAW)


@pytest.mark.parametrize("command", sorted(COMMANDS.keys() - OF_A_SHELL))
def test_python_has_every_command(command):
    function = getattr(wb, folder(command))
    assert folder(command) in wb.__all__
    assert signature(function).parameters
    assert f"`jackbench {command}`" in function.__doc__ or function.__module__ != "workbench.notebook.commands"


def test_a_shell_s_own_commands_are_no_functions():
    assert not OF_A_SHELL & set(FUNCTIONS)


def test_an_answer_is_that_of_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = {"input": "command", "output": "spool"}
    assert main(["spread", "first_loop", "--json"]) == 0
    assert wb.spread("first_loop") == json.loads(capsys.readouterr().out)
    outcome = wb.frequency("sample", **asked)
    assert not list(tmp_path.iterdir())
    words = [word for name, value in asked.items() for word in (f"--{name}", value)]
    assert main(["frequency", "sample", *words, "--out", "out"]) == 0
    outcome.report("python")
    assert wb.frequency("sample", **asked, out="mine").metrics == outcome.metrics
    for place in ("python", "mine"):
        assert (tmp_path / place / "metrics.json").read_bytes() == (tmp_path / "out" / "metrics.json").read_bytes()
    assert not capsys.readouterr().out.count("mine")


def test_a_rig_of_python_serves_as_a_file_does(tmp_path, loop):
    said = wb.excite(
        loop.rig, "chirp", signal="command", amplitude=0.05, seconds=2, band=(1, 20), out=tmp_path / "x.csv"
    )
    assert "x.csv" in said
    assert wb.read_record(tmp_path / "x.csv").t[-1] >= 1.9


def test_bad_input_is_one_line_and_a_wrong_name_is_python_s_own(loop):
    with pytest.raises(wb.InputError, match="--margin 5 kg"):
        wb.limit("first_loop", margin="5 kg")
    with pytest.raises(wb.InputError, match="excite: argument"):
        wb.excite(loop.rig, "noise", out="x.csv")
    with pytest.raises(TypeError, match="plant"):
        wb.limit("first_loop", plant=3)


def test_a_loop_of_a_notebook_becomes_code(tmp_path, capsys):
    pressure = PressureFeedback(gain="2.15e-4 1/bar", corner="0.25 Hz")
    loop = wb.ClosedLoop("jack-10t", (P(gain=3.7) + pressure).named("p-dp"))
    said = loop.code(tmp_path / "python")
    assert main(["coefficients", "position_step", "--controller", "p-dp", "--out", str(tmp_path / "shell")]) == 0
    assert said.partition(": ")[2] == capsys.readouterr().out.strip().partition(": ")[2]
    for name in ("p_dp.c", "p_dp.h", "p_dp.st", "p_dp.json", "link_laws.h"):
        assert (tmp_path / "python" / name).read_bytes() == (tmp_path / "shell" / name).read_bytes(), name


def test_a_loop_of_a_notebook_becomes_an_fmu(tmp_path, loop):
    try:
        said = loop.fmu(tmp_path / "mine")
    except wb.InputError as error:
        pytest.skip(str(error))
    (file,) = (tmp_path / "mine").iterdir()
    assert file.suffix == ".fmu"
    assert "reference" in said


def test_a_controller_in_plain_python_has_no_code(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from workbench import design_numbers\nclass Mine:\n    @design_numbers\n    class Design:\n        pass\n\n"
        "    measures = ('position',)\n    def __init__(self, design, period): pass\n"
        "    def reset(self, r, m, u): self.u = u\n    def compute(self, r, m): return 0.2 * (r - m['position'])\n"
        "    def update(self, u): pass\n"
    )
    loop = wb.ClosedLoop("jack-10t", wb.controller(f"{tmp_path / 'mine.py'}:Mine"))
    with pytest.raises(wb.InputError, match="graph"):
        loop.code(tmp_path / "code")
    assert not (tmp_path / "code").exists()
