"""A controller and an effect are one file, a key of an experiment is one line: each is added to a copy, and used."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CONTROLLER = '''"""Half as much as P."""

from workbench.control.law import LawController, static_law
from workbench.control.protocol import design_numbers, number


class Halved(LawController):
    """u = K e/2 on the position."""

    measures = ("position",)

    @design_numbers
    class Design:
        gain: float = number("1/m", 1e-3, 1e3, "command per half position error")

    def __init__(self, design: Design, period: float) -> None:
        super().__init__(static_law([design.gain / 2, -design.gain / 2], self.measures, period))
'''
EFFECT = '''"""oil.foam: a share of the flow is lost."""

from ..decorator import effect, number

SHARE = number("x", 0.01, "1", low=0.0, high=0.1, off=0.0, meaning="share of the modulus that foam takes")


@effect("oil.foam", "plain", equation="flow", slot="modulus", shows="steps", source="this test", numbers=(SHARE,))
def foam(modulus, s):
    """K = beta (1 - x)."""
    return modulus * (1 - s.p("x"))
'''
KEY = '    knocks: int = count(1, 9, "how often each fault knocks", default=2, asked=True)\n'
EXPERIMENT = """experiment = "faults"
rig = "jack-10t"
plants = 1
seconds = "200 ms"
stroke = 0.9
steps = {position = "100 mm"}
within = {M = [0.9, 1.1]}
controllers.p = {use = "controllers.p:P", gain = "3.7 1/m"}
"""
PAGE = """
import json, sys
from importlib import import_module
sys.path.insert(0, "docs")
print(json.dumps(import_module(f"generate.{sys.argv[1]}").pages()[sys.argv[2]]))
"""


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    folder = tmp_path_factory.mktemp("house")
    for name in ("workbench", "controllers", "envs", "docs/generate", "docs/files"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def said(house, *words, status=0):
    """What a process of Python in the copy prints; of one that fails, its complaint."""
    there = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (house, ROOT / ".ci")))}
    done = subprocess.run([sys.executable, *words], cwd=house, env=there, capture_output=True, text=True)
    assert done.returncode == status, done.stderr
    return done.stderr if status else done.stdout


def reference(house, part, page):
    return json.loads(said(house, "-c", PAGE, part, page))


def test_a_new_controller_is_one_file(house):
    (house / "controllers" / "halved.py").write_text(CONTROLLER)
    rows = json.loads(said(house, "-m", "workbench.cli", "list", "controllers", "--json"))
    assert [row["summary"] for row in rows if row["name"] == "halved"] == ["u = K e/2 on the position."]
    assert "command per half position error" in reference(house, "controllers", "controllers.md")
    step = 'wb.ClosedLoop(wb.load_rig("jack-10t"), {}).step("1 mm").metrics["peak_command"]'
    both = ", ".join(map(step.format, ("Halved(gain=7.4)", "P(gain=3.7)")))
    script = f"import workbench as wb\nfrom controllers import *\nprint({both})"
    first, second = map(float, said(house, "-c", script).split())
    assert first == pytest.approx(second, rel=1e-12)
    loops = (ROOT / "experiments" / "first_loop.toml").read_text()
    (house / "own.toml").write_text(loops.replace("controllers.p:P", "controllers.halved:Halved"))
    said(house, "-m", "workbench.cli", "coefficients", "own.toml", "--out", "halved")
    assert list((house / "halved").glob("**/*.c"))


def test_a_new_effect_is_one_file(house):
    (house / "workbench/plant/effects/library/foam.py").write_text(EFFECT)
    rows = json.loads(said(house, "-m", "workbench.cli", "list", "effects", "--json"))
    assert "oil.foam" in {row["name"] for row in rows}
    assert "share of the modulus that foam takes" in reference(house, "effects", "effects.md")
    rig = (house / "workbench/rigs/jack-10t.toml").read_text()
    (house / "foam.toml").write_text(rig + '\n[[effects]]\nname = "oil.foam"\nx = {value = 0.19, unit = "1"}\n')
    refused = said(house, "-m", "workbench.cli", "show", "foam.toml", status=2)
    assert "oil.foam: x = 0.19 1 is outside 0 to 0.1 1" in refused
    (house / "foam.toml").write_text(rig + '\n[[effects]]\nname = "oil.foam"\nx = {value = 0.1, unit = "1"}\n')
    script = """
import workbench as wb
for name in ("jack-10t", "foam.toml"):
    plant = wb.build(wb.load_rig(name))
    poles = wb.linearise(plant, wb.equilibrium(plant)).poles()
    print(min((p for p in poles if p.imag > 0), key=lambda p: abs(p.real / p)).imag)
"""
    stiff, soft = map(float, said(house, "-c", script).split())
    assert soft / stiff == pytest.approx(0.9**0.5, abs=0.01)  # of the mass on its oil


def test_a_new_key_of_an_experiment_is_one_line(house):
    options = house / "workbench/commands/faults/options.py"
    before = '    stroke: float = fraction("of the stroke limit in which steps lie")\n'
    assert before in options.read_text()
    options.write_text(options.read_text().replace(before, KEY + before))
    (house / "faults.toml").write_text(EXPERIMENT + "\n")
    (house / "wrong.toml").write_text(f"knocks = 12\n{EXPERIMENT}")
    command = ["-m", "workbench.cli", "faults"]
    assert "how often each fault knocks (default: the experiment's)" in said(house, *command, "--help")
    assert "line 1: knocks = 12: must be a whole number, from 1 to 9" in said(house, *command, "wrong.toml", status=2)
    assert "knocks" in said(house, *command, "faults.toml", "--knocks", "12", status=2)
    row = "| `knocks` | whole number, 1 to 9 | how often each fault knocks |"
    assert row in reference(house, "files", "experiment_files.md")
    script = """
import inspect, workbench as wb
from controllers import P
from workbench.commands.faults.options import FaultsConfig
print(inspect.signature(wb.faults).parameters["knocks"].default, FaultsConfig.load("faults.toml", knocks=3).asked)
try:
    wb.faults(wb.ClosedLoop(wb.load_rig("jack-10t"), P(gain=3.7)), plants=1, knocks=10)
except wb.InputError as error:
    print(error)
"""
    assert said(house, "-c", script).splitlines() == [
        "2 {'plants': 1, 'knocks': 3}",
        "faults: knocks: is 10; give a whole number, 1 to 9",
    ]
