"""What a command imports before it computes: start-up is held by the modules loaded, not by a clock."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PRINTED = "import sys; from workbench.cli import main; status = main(sys.argv[1:]); print(status, *sys.modules)"
HEAVY = {
    "scipy",
    "control",
    "casadi",
    "matplotlib",
    "llvmlite",
    "cmaes",
    "h5py",
    "pint",
    "pandas",
    "pyarrow",
    "gymnasium",
    "workbench.engine.engine",
    "workbench.engine.compiled",
    "workbench.report",
    "workbench.identify",
}
SHEET = ["trace", "experiments/maker_main_stage.csv", "--output", "flow"]
VERSION = """
import atexit, sys
atexit.register(lambda: print(*sys.modules))
from workbench.cli import main
main(["--version"])
"""


def loaded(code: str, *words: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code, *words], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()


def test_the_version_needs_only_the_standard_library_and_what_loads_the_rest_later():
    roots = {name.partition(".")[0] for name in loaded(VERSION)} - {"sitecustomize", "usercustomize"}
    ours = {name for name in roots if not name.startswith("_")} - sys.stdlib_module_names
    assert ours == {"workbench", "lazy_loader"}


@pytest.mark.parametrize("kind", ["rigs", "controllers", "effects", "experiments"])
def test_a_list_imports_no_solver(kind):
    status, *modules = loaded(PRINTED, "list", kind)
    assert status == "0"
    # an effect is a function of CasADi, which takes scipy, and its numbers have units
    graphs = {"casadi", "scipy", "pint"} if kind == "effects" else set()
    assert HEAVY & set(modules) <= graphs


@pytest.mark.parametrize(
    "words",
    [
        ["run", "nothere.toml"],
        ["run", "experiments/position_step.toml", "--rig", "jack"],
        ["bench", "experiments/benchmark.toml", "--rig", "jack"],
        ["tune", "nothere.toml"],
        ["time", "nothere.toml"],
        ["live", "nothere.toml"],
        ["coefficients", "nothere.toml"],
        ["spread", "nothere.toml"],
        ["jack-model", "nothere.toml"],
        ["residual", "nothere"],
        ["fit", "nothere"],
        ["trace", "nothere"],
        ["plan", "nothere"],
        [*SHEET, "--amplitude", "1"],
        [*SHEET, "--amplitude", "1", "--rig", "jack"],
        [*SHEET, "--rig", "jack-10t"],
        [*SHEET, "--amplitude", "1", "--rig", "jack-10t", "--without", "x"],
        ["trace", "experiments/sample", "--without", "drive.lagg"],
        ["frequency", "nothere", "--output", "spool"],
        ["excite", "jack", "steps", "--amplitude", "1", "--seconds", "1", "--out", "x.csv"],
        ["record", "jack"],
        ["new-rig", "nothere.toml"],
        ["import", "nothere.csv", "--rig", "jack-10t"],
        ["import", "nothere.csv", "--rig", "jack"],
        ["compare", "a", "b"],
        ["show", "jack"],
        ["fmu", "jack"],
        ["speed", "--rig", "jack"],
        ["open", "nothere"],
    ],
    ids=" ".join,
)
def test_a_refusal_imports_no_study(words):
    status, *modules = loaded(PRINTED, *words)
    assert status == "2"
    assert not HEAVY & set(modules)
    assert not [name for name in modules if name.startswith("workbench.commands") and name.endswith(".study")]
