"""The scripts of examples/, run: their text, what they print and the figure that they leave."""

import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path

from .markdown import page, plain
from .readme import ROOT

_FOLDER = ROOT / "examples"
_SOURCES = ("workbench", "controllers", "envs", "experiments/sample")
_KINDS = (".py", ".toml", ".csv", ".gz")
_AT_ONCE = 2
_LONGEST = 600  # s of a script

_INTRODUCTION = """Each of these is a script of `examples/`, which reads plant, controller, reference, simulation, plot.
They run when these pages are built: what a page shows is what the script printed and drew then. From a clone:
`.venv/bin/python examples/loop.py`."""


def pages(folder: Path, cache: Path) -> dict[str, str]:
    """A page for each script, in the order of the table of examples/README.md; `folder` gets the figures.

    A script runs again where it, or the code that it runs on, has changed. Raises RuntimeError for one that fails.
    """
    lessons = re.findall(r"^\| `(\w+)\.py` \| (.*?) \|$", (_FOLDER / "README.md").read_text("utf-8"), re.MULTILINE)
    sources = source_digest()
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        runs = list(pool.map(lambda lesson: _run(lesson[0], cache, sources), lessons))
    made = {}
    for (name, lesson), (printed, figure) in zip(lessons, runs, strict=True):
        picture = folder / f"{name}.png"
        if not picture.exists() or picture.read_bytes() != figure:
            picture.write_bytes(figure)
        made[f"tutorial_{name}.md"] = _page(name, lesson, printed)
    names = "\n".join(f"tutorial_{name}" for name, _ in lessons)
    made["tutorials.md"] = page("Tutorials", _INTRODUCTION, f"```{{toctree}}\n:maxdepth: 1\n\n{names}\n```")
    return made


def _page(name: str, lesson: str, printed: str) -> str:
    return page(
        lesson[0].upper() + lesson[1:],
        plain(f"The script `examples/{name}.py`, run when this page was built."),
        f"```{{literalinclude}} ../../examples/{name}.py\n```",
        "## What it prints",
        f"```text\n{printed.rstrip()}\n```",
        "## What it draws",
        f"```{{image}} {name}.png\n:alt: the figure that {name}.py leaves\n```",
    )


def source_digest() -> bytes:
    """Of all code and data that a script can depend on."""
    files = sorted(path for name in _SOURCES for path in (ROOT / name).rglob("*") if path.suffix in _KINDS)
    return sha256(b"".join(sha256(path.read_bytes()).digest() for path in files)).digest()


def _run(name: str, cache: Path, sources: bytes) -> tuple[str, bytes]:
    """What a script prints, and its figure; from the cache where neither it nor the sources have changed."""
    key = sha256((_FOLDER / f"{name}.py").read_bytes() + sources).hexdigest()
    folder, kept = cache / name, cache / name / "key.txt"
    if not kept.exists() or kept.read_text("utf-8") != key:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        (folder / "printed.txt").write_text(_printed(name, folder), "utf-8")
        kept.write_text(key, "utf-8")
    return (folder / "printed.txt").read_text("utf-8"), (folder / "out" / f"{name}.png").read_bytes()


def _printed(name: str, folder: Path) -> str:
    """What a script prints that runs in a folder, as a user's would: nothing is trusted that it does not trust."""
    inherited = {key: value for key, value in os.environ.items() if key != "JACKBENCH_TRUSTED"}
    environment = {**inherited, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    call = [sys.executable, str(_FOLDER / f"{name}.py")]
    run = subprocess.run(
        call, cwd=folder, env=environment, capture_output=True, text=True, timeout=_LONGEST, check=False
    )
    if run.returncode:
        raise RuntimeError(f"examples/{name}.py: {run.stderr.strip().splitlines()[-1]}")
    return run.stdout.replace(str(folder), ".")
