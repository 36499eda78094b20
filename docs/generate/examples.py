"""The scripts of examples/, run: their text, what they print and the figure that they leave."""

import re
from pathlib import Path

from .markdown import page, plain
from .readme import ROOT
from .runs import Cell, Run, run_all

_FOLDER = ROOT / "examples"

_INTRODUCTION = """Each of these is a script of `examples/`, which reads plant, controller, reference, simulation, plot.
They run when these pages are built: what a page shows is what the script printed and drew then. From a clone:
`.venv/bin/python examples/loop.py`."""


def pages(folder: Path, cache: Path, run: bool) -> dict[str, str]:
    """A page for each script, in the order of the table of examples/README.md; `folder` gets the figures.

    Where they `run`, those do that have changed, or whose code has. Raises RuntimeError for one that fails. A page of
    a script that left nothing has its text alone.
    """
    lessons = re.findall(r"^\| `(\w+)\.py` \| (.*?) \|$", (_FOLDER / "README.md").read_text("utf-8"), re.MULTILINE)
    runs = [_run(name, cache / name) for name, _ in lessons]
    if run:
        run_all(runs)
    made = {
        f"tutorial_{name}.md": page(*_words(name, lesson), *_results(name, ran, folder))
        for (name, lesson), ran in zip(lessons, runs, strict=True)
    }
    names = "\n".join(f"tutorial_{name}" for name, _ in lessons)
    made["tutorials.md"] = page("Tutorials", _INTRODUCTION, f"```{{toctree}}\n:maxdepth: 1\n\n{names}\n```")
    return made


def _run(name: str, folder: Path) -> Run:
    return Run(f"examples/{name}.py", (Cell("shell", "", f'python "$PYTHONPATH/examples/{name}.py"'),), folder)


def _words(name: str, lesson: str) -> list[str]:
    return [
        lesson[0].upper() + lesson[1:],
        plain(f"The script `examples/{name}.py`, run when this page was built."),
        f"```{{literalinclude}} ../../examples/{name}.py\n```",
    ]


def _results(name: str, run: Run, folder: Path) -> list[str]:
    """What a script printed and drew, with its figure in `folder`; nothing where it did not run."""
    left = run.left()
    if left is None:
        return []
    picture, figure = folder / f"{name}.png", (run.made / "out" / f"{name}.png").read_bytes()
    if not picture.exists() or picture.read_bytes() != figure:
        picture.write_bytes(figure)
    return [
        "## What it prints",
        f"```text\n{left[0]['printed'].rstrip()}\n```",
        "## What it draws",
        f"```{{image}} {name}.png\n:alt: the figure that {name}.py leaves\n```",
    ]
