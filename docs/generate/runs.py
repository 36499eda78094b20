"""What the site runs: blocks of pages, scripts and commands, each page's in a folder and a process of its own.

What they left is kept until they, or the code that they run on, change. The first that fails ends the build.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeAlias

from .readme import ROOT

LONGEST = 900  # s of CPU time of a block, a script or a command, in each of its processes
_PATIENCE = 3600.0  # s by the clock of a page, which may wait for what never comes
_AT_ONCE = 2
_SOURCES = ("workbench", "controllers", "envs", "experiments")
_KINDS = (".py", ".toml", ".csv", ".gz", ".npz")
_DRIVER = Path(__file__).parent / "run_cells.py"
_GIVEN = {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg", "COLUMNS": "110"}

Left: TypeAlias = list[dict[str, Any]]  # of each block: what it printed, and the names of its pictures


@dataclass(frozen=True)
class Cell:
    """A block of a page: its kind, the name of its file if it is one, and its text."""

    kind: str
    name: str
    text: str


@dataclass(frozen=True)
class Run:
    """Blocks that run in their order in `made`, a folder of their own, under a name that the build prints."""

    name: str
    cells: tuple[Cell, ...]
    folder: Path

    @property
    def made(self) -> Path:
        """The folder that the blocks run in."""
        return self.folder / "made"

    def left(self) -> Left | None:
        """What the blocks left; None unless they ran as they are now, on the code as it is now."""
        kept = self.folder / "key.txt"
        if not kept.exists() or kept.read_text("utf-8") != self.key:
            return None
        return json.loads((self.folder / "left.json").read_text("utf-8"))

    @property
    def asked(self) -> str:
        """The blocks as their process reads them."""
        return json.dumps([vars(cell) for cell in self.cells])

    @property
    def key(self) -> str:
        """Of the blocks, and of all code and data that they can depend on."""
        return sha256(self.asked.encode() + _source_digest()).hexdigest()


@cache
def _source_digest() -> bytes:
    scripts = [_DRIVER, *(ROOT / "examples").glob("*.py"), *(ROOT / ".ci").glob("walks.py")]
    files = [path for name in _SOURCES for path in sorted((ROOT / name).rglob("*")) if path.suffix in _KINDS]
    return sha256(b"".join(sha256(path.read_bytes()).digest() for path in [*sorted(scripts), *files])).digest()


def run_all(runs: Sequence[Run]) -> None:
    """Run what has left nothing yet, some at once, each block with a line and its CPU time.

    Raises RuntimeError, which names page and block, for the first that fails; what runs beside it is ended.
    """
    waiting = [run for run in runs if run.left() is None]
    running: dict[Run, subprocess.Popen[bytes]] = {}
    began: dict[Run, float] = {}
    try:
        while waiting or running:
            while waiting and len(running) < _AT_ONCE:
                run = waiting.pop(0)
                running[run], began[run] = _started(run), time.monotonic()
            time.sleep(0.05)
            for run in [run for run, process in running.items() if process.poll() is not None]:
                _end(run, running.pop(run).returncode)
            for run in running:
                if time.monotonic() - began[run] > _PATIENCE:
                    raise RuntimeError(f"{_place(run)}: waits for more than {_PATIENCE:g} s")
    finally:
        for process in running.values():
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _started(run: Run) -> "subprocess.Popen[bytes]":
    """The process of a page, as a user would run it who has trusted nothing."""
    shutil.rmtree(run.folder, ignore_errors=True)
    run.made.mkdir(parents=True)
    asked, left = run.folder / "cells.json", run.folder / "left.json"
    asked.write_text(run.asked, "utf-8")
    left.write_text("[]", "utf-8")
    inherited = {name: value for name, value in os.environ.items() if name != "JACKBENCH_TRUSTED"}
    path = f"{Path(sys.executable).parent}{os.pathsep}{inherited.get('PATH', '')}"
    call = [sys.executable, str(_DRIVER), run.name, str(LONGEST), str(asked), str(left)]
    with (run.folder / "stderr.txt").open("wb") as said:
        environment = {**inherited, **_GIVEN, "PATH": path}
        return subprocess.Popen(call, cwd=run.made, env=environment, stderr=said, start_new_session=True)


def _end(run: Run, status: int) -> None:
    """Keep what a page left, or say which of its blocks failed."""
    if status:
        said = (run.folder / "stderr.txt").read_text("utf-8", "replace").strip()[-2000:]
        late = f"takes more than {LONGEST} s of CPU time" if status == -signal.SIGXCPU else ""
        raise RuntimeError(f"{_place(run)}: {late or said or f'ends with {status}'}")
    (run.folder / "key.txt").write_text(run.key, "utf-8")


def _place(run: Run) -> str:
    """The name of a page with the block that it is at."""
    return f"{run.name}, cell {len(json.loads((run.folder / 'left.json').read_text('utf-8'))) + 1}"
