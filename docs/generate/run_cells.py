"""Runs the blocks of one page, in a process of its own: cells.json in, left.json out. `runs` starts it."""

import ast
import contextlib
import io
import json
import resource
import signal
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Any

_PICTURES = (".png", ".svg")


def main(page: str, longest: str, asked: str, left: str) -> int:
    """Run every block in the working folder, each within `longest` s of CPU time; 1 with words on stderr for the first
    that fails. `left` has those that are done."""
    sys.path[0] = ""  # the folder of the page, and not this one
    names: dict[str, Any] = {"__name__": "__page__"}
    done: list[dict[str, Any]] = []
    for number, cell in enumerate(json.loads(Path(asked).read_text("utf-8"))):
        before, spent = _pictures(), _spent()
        _limit(int(longest) + 1 + int(_own_spent()))
        try:
            printed = _RUN[cell["kind"]](cell, names, number)
        except BaseException:
            print(_words(traceback.format_exc()), file=sys.stderr)
            return 1
        new = [name for name, time in _pictures().items() if before.get(name) != time]
        done.append({"printed": _words(printed), "pictures": new})
        Path(left).write_text(json.dumps(done), "utf-8")
        if cell["kind"] != "file":
            first = _words(cell["text"].strip().partition("\n")[0])[:80]
            print(f"{_spent() - spent:7.1f} s  {page}, cell {number + 1}: {first}", flush=True)
    return 0


def _words(text: str) -> str:
    """A text without the folders of this machine."""
    return text.replace(str(Path.cwd()), ".").replace(str(Path.home()), "~")


def _own_spent() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _spent() -> float:
    """CPU time of this process and of those that it has waited for, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return _own_spent() + used.ru_utime + used.ru_stime


def _limit(seconds: int) -> None:
    """Have the system end this process at this CPU time, s."""
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.getrlimit(resource.RLIMIT_CPU)[1]))


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
    if run.returncode in (-signal.SIGXCPU, 128 + signal.SIGXCPU):
        signal.raise_signal(signal.SIGXCPU)  # what it started had the limit of this process
    if run.returncode:
        raise RuntimeError(f"{cell['text']}: {run.stderr.strip() or run.stdout.strip()}")
    return run.stdout


def _file(cell: dict[str, str], names: dict[str, Any], number: int) -> str:
    path = Path(cell["name"])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(cell["text"], "utf-8")
    return ""


_RUN = {"python": _python, "shell": _shell, "file": _file}

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
