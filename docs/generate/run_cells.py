"""Runs the blocks of one page, in a process of its own: cells.json in, left.json out. `cells` says what they are."""

import ast
import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

_PICTURES = (".png", ".svg")


def main(asked: str, left: str) -> int:
    """Run every block in the working folder; 1 with a line on stderr where one fails."""
    sys.path[0] = ""  # the folder of the page, and not this one
    names: dict[str, Any] = {"__name__": "__page__"}
    done: list[dict[str, Any]] = []
    for number, cell in enumerate(json.loads(Path(asked).read_text("utf-8"))):
        before = _pictures()
        printed = _RUN[cell["kind"]](cell, names, number)
        new = [name for name, time in _pictures().items() if before.get(name) != time]
        shown = printed.replace(str(Path.cwd()), ".").replace(str(Path.home()), "~")
        done.append({"printed": shown, "pictures": new})
    Path(left).write_text(json.dumps(done), "utf-8")
    return 0


def _pictures() -> dict[str, int]:
    """Pictures in the folder, not those inside run folders, with the time of their last change."""
    return {path.name: path.stat().st_mtime_ns for path in sorted(Path().iterdir()) if path.suffix in _PICTURES}


def _python(cell: dict[str, str], names: dict[str, Any], number: int) -> str:
    """What the lines print, with the last one's value shown as a notebook does."""
    tree = ast.parse(cell["text"])
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "page", "exec"), names)
        if isinstance(last, ast.Expr):
            _show(eval(compile(ast.Expression(last.value), "page", "eval"), names), number)
    return printed.getvalue()


def _show(value: Any, number: int) -> None:
    """A figure becomes a picture, anything else its repr."""
    if type(value).__name__ == "Figure" and hasattr(value, "save"):
        value.save(f"figure_{number}.png")
    elif value is not None:
        print(repr(value))


def _shell(cell: dict[str, str], names: dict[str, Any], number: int) -> str:
    run = subprocess.run(["bash", "-e", "-c", cell["text"]], capture_output=True, text=True, check=False)
    if run.returncode:
        raise SystemExit(f"{cell['text']}: {run.stderr.strip()}")
    return run.stdout


def _file(cell: dict[str, str], names: dict[str, Any], number: int) -> str:
    path = Path(cell["name"])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(cell["text"], "utf-8")
    return ""


_RUN = {"python": _python, "shell": _shell, "file": _file}

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
