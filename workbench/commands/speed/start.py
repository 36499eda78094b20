"""What a command costs before it computes: CPU time of new processes, the least of a few."""

import os
import subprocess
import sys

_CLI = "import sys; from workbench.cli import main; main(sys.argv[1:])"
_SIMULATION = """
import numpy as np
from workbench import Engine, build, equilibrium, load_rig
plant = build(load_rig("jack-10t"))
Engine(plant).run(equilibrium(plant).x, np.arange(1001) * 1e-3, np.zeros((1001, len(plant.inputs))))
"""
_PROCESSES = {
    "version": (_CLI, "--version"),
    "numpy": ("import numpy",),
    "list": (_CLI, "list", "rigs"),
    "refusal": (_CLI, "run", "nothere.toml"),
    "first_simulation": (_SIMULATION,),
}
_REPEATS = 3


def start_times() -> dict[str, float]:
    """{"version_cpu_s": ...}: user and system time [s] of a new process; POSIX only, elsewhere 0."""
    return {f"{name}_cpu_s": min(_cpu(words) for _ in range(_REPEATS)) for name, words in _PROCESSES.items()}


def _cpu(words: tuple[str, ...]) -> float:
    before = os.times()
    subprocess.run([sys.executable, "-c", *words], capture_output=True, check=False)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system
