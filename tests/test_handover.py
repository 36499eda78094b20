"""Laws handed over: C and Structured Text do what the law does, limited, tripped and started anew; .mat are linear."""

import json
import shutil
import subprocess
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.io import loadmat
from structured_text import Block, Instance, units_of
from test_coefficients import DITHER, LAP, SCHEDULED, SHAPING, around
from test_compiled_loop import SHIPPED
from test_controllers import CONTROLLERS, PERIOD, make

from workbench.cli import main
from workbench.control.compensators import compensated
from workbench.control.export.c_code import c_code
from workbench.control.export.program import Program, identifier
from workbench.control.export.structured_text import structured_text
from workbench.control.piecewise_linear import CommandMap
from workbench.control.protocol import graph_law
from workbench.linear import equilibrium, linear_plant
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

GCC = shutil.which("gcc")
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
no_compiler = pytest.mark.skipif(GCC is None, reason="no C compiler here")


def program_of(controller, name="law"):
    return Program(name, graph_law(controller))


def compiled(folder, program):
    """The status and the words of the program that checks a law."""
    for file, text in c_code(program).items():
        (folder / file).write_text(text)
    check, plain = folder / "check", identifier(program.name)
    source = [f"-DCHECK_{plain.upper()}", str(folder / f"{plain}.c"), "-o", str(check), "-lm"]
    subprocess.run([GCC, *STRICT, *source], check=True)
    return subprocess.run([check], check=False, capture_output=True, text=True)


@no_compiler
@pytest.mark.parametrize("name", SHIPPED)
def test_the_c_of_every_shipped_law_gives_its_vector(tmp_path, name):
    """Nothing is allocated."""
    program = program_of(SHIPPED[name].build(PERIOD), name)
    done = compiled(tmp_path, program)
    assert done.returncode == 0, done.stdout
    assert "alloc" not in (tmp_path / f"{identifier(name)}.c").read_text()


@no_compiler
@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_c_of_a_law_within_all_compensators_gives_its_vector(tmp_path, name):
    done = compiled(tmp_path, program_of(around(name, SCHEDULED, LAP, DITHER, SHAPING), f"3 {name}"))
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("name", SHIPPED)
def test_the_vector_saturates_slows_down_trips_and_starts_anew(name):
    """So that a law without its anti-windup does not pass."""
    vector = program_of(SHIPPED[name].build(PERIOD)).vector
    differs = np.abs(vector.realised - vector.command) > 1e-3 * np.abs(vector.command).max()
    assert differs[200:260].sum() > 10
    assert vector.realised[290:300] == pytest.approx(0.0, abs=1e-12)
    assert vector.start.sum() == 2
    assert vector.held[300] > 0


MOST = 0.01  # of the command: what the drive does


def saturated(step, realised):
    """Commands of 2 s at the limit 10 mm short of a target, and then 10 mm beyond it."""
    commands, sent = [], 0.0
    for k in range(2100):
        commands.append(step(0.0, -0.2 if k < 2000 else 0.01))
        sent = float(np.clip(commands[-1], -MOST, MOST))
        realised(sent)
    return commands


def wound_up():
    """The last of those commands where the law takes the drive for doing what is demanded."""
    controller = make("pid-lead")
    controller.reset(0.0, {"position": 0.0}, 0.0)
    demanded = 0.0
    for k in range(2100):
        demanded = controller.compute(0.0, {"position": -0.2 if k < 2000 else 0.01})
        controller.update(demanded)
    return demanded


@no_compiler
def test_the_exported_pid_does_not_wind_up(tmp_path):
    """After two seconds of saturation: the program gives what the controller gives, and that is not wound up."""
    controller = make("pid-lead")
    controller.reset(0.0, {"position": 0.0}, 0.0)
    wanted = saturated(lambda r, y: controller.compute(r, {"position": y}), controller.update)
    for file, text in c_code(program_of(make("pid-lead"))).items():
        (tmp_path / file).write_text(text)
    loop = (
        f"const double MOST = {MOST};"
        + """
    law_state s; law_start(&s, 0.0, 0.0);
    for (int k = 0; k < 2100; k++) {
        const double u = law_step(&s, 0.0, k < 2000 ? -0.2 : 0.01);
        printf("%.17g\\n", u);
        law_realised(&s, fmin(fmax(u, -MOST), MOST));
    }
    return 0;"""
    )
    (tmp_path / "main.c").write_text(
        f'#include <math.h>\n#include <stdio.h>\n#include "law.h"\nint main(void) {{ {loop} }}\n'
    )
    files = [str(tmp_path / name) for name in ("main.c", "law.c")]
    subprocess.run([GCC, *STRICT, *files, "-lm", "-o", str(tmp_path / "run")], check=True)
    printed = subprocess.run([tmp_path / "run"], check=True, capture_output=True, text=True).stdout.split()
    assert [float(word) for word in printed] == pytest.approx(wanted, abs=1e-9)
    assert wound_up() > wanted[-1] + 0.1


@no_compiler
def test_the_check_in_c_notices_a_wrong_limit(tmp_path):
    program = program_of(SHIPPED["mpc"].build(PERIOD))
    assert len(program.vector.command)  # of the law as it is
    planned_kernel = planned_of(program).kernel
    planned_kernel.table("REACH")[:] *= 1 + 1e-4
    assert compiled(tmp_path, program).returncode == 1


def planned_of(program):
    law = program.law
    while law.inner is not None:
        law = law.inner
    return law.planned


@no_compiler
def test_the_check_in_c_notices_a_wrong_number(tmp_path):
    law = graph_law(make("pid-lead"))
    program = Program("law", law)
    assert len(program.vector.command)
    law.numbers[2] *= 1 + 1e-4  # how it follows what the drive did: only a limited command tells
    assert compiled(tmp_path, program).returncode == 1


def played(program, block):
    """The largest difference of a function block from the law's vector, over the largest command."""
    vector, last, worst = program.vector, 0.0, 0.0
    ahead = program.law.preview
    for k, command in enumerate(vector.command.tolist()):
        signals = {name: float(vector.signals[name][k]) for name in program.law.measures}
        asked = vector.signals["reference"][k].tolist()
        setpoint = asked if ahead else asked[0]
        block(start=bool(vector.start[k]), held=float(vector.held[k]), realised=last, setpoint=setpoint, **signals)
        worst, last = max(worst, abs(block.values["command"] - command)), float(vector.realised[k])
    return worst / np.abs(vector.command).max()


@pytest.mark.parametrize("name", SHIPPED)
def test_the_structured_text_of_every_shipped_law_gives_its_vector(name):
    spec = SHIPPED[name]
    if spec.use.endswith(":Mpc"):  # of a short horizon, as it is played line by line
        short = {"horizon": 0.01, "moves": 3, "preview": min(spec.design.preview, 0.01)}
        spec = replace(spec, design=replace(spec.design, **short))
    program = program_of(spec.build(PERIOD), name)
    plain = identifier(name)
    assert played(program, Block(structured_text(program)[f"{plain}.st"], plain)) < 1e-9


def test_the_structured_text_passes_the_grammar_of_another_project():
    """Which takes its time: a law whose states, table and start are few, and its check."""
    law = graph_law(compensated(make("pid-lead"), Bends()))
    program = Program("law", law)
    few = Program("law", law)
    few.__dict__["vector"] = program.vector.first(4)
    text = structured_text(few)["law.st"]
    units = units_of(text)
    assert played(program, Instance(units["law"], units)) < 1e-9
    assert played(program, Block(text, "law")) < 1e-9
    check = Instance(units["law_check"], units)
    for _ in range(5):
        check()
    assert check.values["done"]
    assert check.values["passed"]


class Bends:
    """A map of the command with few points."""

    into = "map"
    command_map = CommandMap(np.array([-1.0, -0.02, 0.0, 0.02, 1.0]), np.array([-1.0, -0.03, 0.0, 0.03, 1.0]))


REST = {"position": 0.21, "pa": 8e6, "pb": 5e6}
MOVED = {"position": 0.23, "pa": 8.1e6, "pb": 5e6}
HELD = 2e-3


@no_compiler
def test_the_c_of_a_law_starts_without_a_bump(tmp_path):
    controller = around("p", SCHEDULED, LAP)
    controller.reset(REST["position"], REST, HELD)
    wanted = []
    for signals in (REST, REST, MOVED):
        wanted.append(controller.compute(REST["position"], signals))
        controller.update(wanted[-1])
    assert wanted[:2] == pytest.approx([HELD, HELD])
    program = program_of(around("p", SCHEDULED, LAP))
    for file, text in c_code(program).items():
        (tmp_path / file).write_text(text)
    rest, moved = (", ".join(str(signals[name]) for name in program.law.measures) for signals in (REST, MOVED))
    step = 'u = law_step(&s, {at}, {y}); printf("%.17g ", u); law_realised(&s, u);'
    steps = "".join(step.format(at=REST["position"], y=y) for y in (rest, rest, moved))
    body = f"double u; law_state s; law_start(&s, {HELD}, {rest}); {steps} return 0;"
    (tmp_path / "main.c").write_text(f'#include <stdio.h>\n#include "law.h"\nint main(void) {{ {body} }}\n')
    files = [str(tmp_path / name) for name in ("main.c", "law.c")]
    subprocess.run([GCC, *STRICT, *files, "-lm", "-o", str(tmp_path / "run")], check=True)
    printed = subprocess.run([tmp_path / "run"], check=True, capture_output=True, text=True).stdout.split()
    assert [float(word) for word in printed] == pytest.approx(wanted, abs=1e-12)


def test_the_code_of_a_small_law_is_short():
    """A person reads it beside the controller."""
    code = c_code(program_of(make("pid-lead"), "pid-lead"))["pid_lead.c"].partition("#ifdef CHECK")[0]
    assert len(code.splitlines()) < 60
    for word in ("state->lead", "state->integral", "pid_lead_realised"):
        assert word in code


def test_the_folder_holds_every_law(tmp_path, monkeypatch, capsys):
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
