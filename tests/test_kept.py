"""What other people's programs read stays: commands of the contract against what 0.2.0 left for the same input.

tests/kept has experiments in 0.2.0's keys, and kept.json what that version left of each command (`python
tests/test_kept.py` in its tree wrote it). Every key of it is there now, and its numbers are the same to nine digits;
but for CORRECTED, ROUNDED and MOVED, of which the changelog tells, and the limit at +120 mm, which its solver did not
find.
"""

import json
import math
import sys
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from workbench.cli import main

ROOT = Path(__file__).parents[1]
KEPT = Path(__file__).parent / "kept"
FOLDERS = {  # which leave metrics.json
    "paper": ["run", "experiments/paper.toml"],
    "step": ["run", "tests/kept/own.toml"],
    "platform": ["run", "tests/kept/platform.toml"],
    "tune": ["tune", "tests/kept/tune.toml", "--jobs", "1"],
    "bench": ["bench", "tests/kept/bench.toml", "--jobs", "1"],
    "robustness": ["robustness", "tests/kept/robustness.toml", "--jobs", "1"],
    "faults": ["faults", "tests/kept/faults.toml"],
    "sines": ["sines", "tests/kept/sines.toml"],
    "learn": ["learn", "tests/kept/learn.toml"],
    "inverse": ["inverse", "tests/kept/inverse.toml"],
    "limit": ["limit", "tests/kept/own.toml", "--jobs", "1"],
    "capability": ["capability", "jack-10t"],
    "force-test": ["force-test", "experiments/sample"],
    "valve-test": ["valve-test", "experiments/sample"],
    "residual": ["residual", "experiments/sample"],
    "fit": ["fit", "experiments/sample"],
}
PRINTED = {  # which print JSON
    "rigs": ["list", "rigs", "--json"],
    "effects": ["list", "effects", "--json"],
    "show": ["show", "jack-10t", "--json"],
    "coefficients": ["coefficients", "tests/kept/own.toml", "--controller", "p-dp", "--json"],
}
NOT_REPRODUCIBLE = ("timing", "speed")
NAMES = (
    "controller",
    "rig",
    "scenario",
    "id",
    "name",
    "formula",
    "record",
    "signal",
    "stiffness",
    "x_m",
)  # by which rows are told apart
MARGINS = ("gain_margin", "phase_margin", "ms_", "held_")  # found between the points of the grid that 0.2.0 had
CORRECTED = {
    "tune": ("best", "miss", "missed", "cost", "goals_left"),  # which follow from margins
    "bench": ("goals", "margins", "met", *MARGINS),
    "robustness": ("point", "position", *MARGINS),
    "effects": ("high",),  # bounds of real parts
    "faults": ("beyond_percent", "detected_ms"),  # a chamber that is sucked has gas, not tension
    "limit": ("lowest_pressure_bar", "mesh_difference_s", "overshoot_percent", "played_off_percent"),  # above 1 atm
    "capability": ("off",),
}
ROUNDED = (
    "step",
    "bench",
    "robustness",
    "sines",
    "learn",
    "inverse",
    "limit",
)  # readings half way between two steps are the upper; a limit keeps its chambers above 1 atm, not 0
MOVED = ("platform", "fit")  # in the seventh digit: slopes of the graph with gas are rounded in another order


def left(words: list[str], out: Path) -> Any:
    """What a command leaves or prints."""
    printed = StringIO()
    folder = [] if "--json" in words else ["--out", str(out)]
    with chdir(ROOT), redirect_stdout(printed):
        assert main([*words, *folder]) == 0
    if not folder:
        return json.loads(printed.getvalue())
    found = json.loads((out / "metrics.json").read_text("utf-8"))
    return {key: each for key, each in found.items() if key not in NOT_REPRODUCIBLE}


def lost(name: str, kept: Any, now: Any, key: str = "") -> Iterator[str]:
    """Where something that a command left is missing, or is another number."""
    if key.startswith(CORRECTED.get(name, ())):
        return
    if isinstance(kept, dict) and isinstance(now, dict):
        yield from (f"{key}: {each} is gone" for each in kept.keys() - now.keys())
        for each in kept.keys() & now.keys():
            yield from lost(name, kept[each], now[each], each)
    elif isinstance(kept, list) and isinstance(now, list):
        added = len(now) > len(kept)  # a bench has every scenario's automatic law too
        named = {_names(row): row for row in now} if added else {}
        for place, row in enumerate(kept):
            yield from lost(
                name, row, named.get(_names(row)) if added else now[place] if place < len(now) else None, key
            )
    elif not _same(kept, now, key, name):
        yield f"{key} was {str(kept)[:80]}, is {str(now)[:80]}"


def _names(row: Any) -> Any:
    return tuple(str(row.get(key)) for key in NAMES) if isinstance(row, dict) else str(row)


def _same(kept: Any, now: Any, key: str, name: str) -> bool:
    if not isinstance(kept, float) or not isinstance(now, float | int):
        return kept == now
    rounded, moved = name in ROUNDED, name in MOVED
    near = 5e-3 if rounded and key.endswith(("percent", "deg", "db", "worst", "p99")) else 1e-7 if moved else 1e-12
    return math.isclose(kept, now, rel_tol=5e-3 if rounded else 1e-6 if moved else 1e-9, abs_tol=near)


@pytest.mark.parametrize("name", [*FOLDERS, *PRINTED])
def test_a_command_leaves_what_it_left(name, tmp_path):
    kept = json.loads((KEPT / "kept.json").read_text("utf-8"))[name]
    assert list(lost(name, kept, left((FOLDERS | PRINTED)[name], tmp_path / "out"))) == []


if __name__ == "__main__":
    with TemporaryDirectory() as scratch:
        whole = {name: left(words, Path(scratch, name)) for name, words in (FOLDERS | PRINTED).items()}
    (KEPT / "kept.json").write_text(json.dumps(whole, indent=None, separators=(",", ":")) + "\n", "utf-8")
    sys.exit(0)
