"""How far three bundled runs walk through the code, and how large the code is: a line each, beside what is aimed at.

A file counts where a function of it is called that runs beyond the import of a module. The depth of a call is the
number of such functions on the stack, of this project alone, without lambdas and comprehensions. `.ci/walks.py NAME`
prints one of the walks, of which each is a process of its own with an empty cache. All take a minute or two.
"""

import gzip
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).parents[1]
OWN = ("workbench", "controllers", "envs")
_BENCH = """experiment = "bench"
rig = "jack-10t"
scenarios = ["position-10mm"]
[rigs]
position = ["nominal"]
[from]
"EXPERIMENTS/first_loop.toml" = ["p-dp"]
[bode]
low_hz = 1
high_hz = 10
points = 3
amplitudes_percent = [1]
"""
_ROWS = 2001  # of each record of the sample: 2 s, the least that a trace takes
_EFFECT = "jack.friction"  # the one that is tried, as it is the one that the sample lacks


@dataclass(frozen=True)
class Way:
    """A command, the function whose result it is for, and the most files and calls down to it that are aimed at."""

    title: str
    command: str
    product: str
    files: int
    deep: int | None = None


WAYS = {
    "bench": Way("TOML -> bench row", "bench bench.toml --jobs 1 --out out", "workbench/loop/rows.py:row", 100, 9),
    "trace": Way(
        "recording -> trace.json",
        "trace sample --jobs 1 --out out",
        "workbench/identify/trace/verdict.py:judge_search",
        130,
    ),
    "law": Way("law -> C", "coefficients first_loop --out out", "workbench/control/export/c_code.py:c_code", 60),
}


class Walk:
    """What of `folders` is called inside `with`, in every thread: each function with the least number of calls that
    lead to it, itself included, and the largest depth of all."""

    def __init__(self, folders: Sequence[Path]) -> None:
        self.functions: dict[CodeType, int] = {}
        self.deepest = 0
        self._under = tuple(f"{folder}/" for folder in folders)
        self._kinds: dict[CodeType, str] = {}
        self._stacks = threading.local()

    @property
    def files(self) -> set[str]:
        """The files that have a function which was called."""
        return {code.co_filename for code in self.functions}

    def depth(self, path: Path, name: str) -> int:
        """The least number of calls that lead to a function. Raises LookupError where none does."""
        depths = [
            depth for code, depth in self.functions.items() if (code.co_filename, code.co_name) == (str(path), name)
        ]
        if not depths:
            raise LookupError(f"{path}: {name} is not called")
        return min(depths)

    def __enter__(self) -> "Walk":
        threading.setprofile(self._note)
        sys.setprofile(self._note)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)
        threading.setprofile(None)

    def _note(self, frame: FrameType, event: str, _: Any) -> None:
        if event not in ("call", "return"):
            return
        code = frame.f_code
        kind = self._kinds.get(code) or self._kinds.setdefault(code, self._kind(code))
        if kind == "other":
            return
        stack: list[tuple[FrameType, str]] = self._stacks.__dict__.setdefault("own", [])
        if event == "return":
            if stack and stack[-1][0] is frame:
                stack.pop()
            return
        stack.append((frame, kind))
        if kind == "function" and all(kind == "function" for _, kind in stack):
            self.functions[code] = min(len(stack), self.functions.get(code, len(stack)))
            self.deepest = max(self.deepest, len(stack))

    def _kind(self, code: CodeType) -> str:
        """A function, the import of a module, or something else than either."""
        if not code.co_filename.startswith(self._under):
            return "other"
        if code.co_name == "<module>":
            return "import"
        return "other" if code.co_name.startswith("<") else "function"


def walked(words: Sequence[str], folder: Path) -> Walk:
    """The walk of a command that runs in a folder. Raises RuntimeError where it fails."""
    from workbench import cli

    told = StringIO()
    with chdir(folder), redirect_stdout(StringIO()), redirect_stderr(told), Walk([ROOT / name for name in OWN]) as walk:
        status = cli.main(list(words))
    if status:
        raise RuntimeError(f"jackbench {' '.join(words)}: {told.getvalue()}")
    return walk


def line(name: str, folder: Path) -> str:
    """A walk in words, its files in a folder."""
    way = WAYS[name]
    path, _, function = way.product.partition(":")
    walk = walked([*way.command.split(), *_written(name, folder)], folder)
    aims = f"{way.files} files" + (f", {way.deep} calls" if way.deep else "")
    deep = f"{function} is {walk.depth(ROOT / path, function)} calls deep, the deepest call {walk.deepest}"
    return f"{way.title}: {len(walk.files)} files, {len(walk.functions)} functions; {deep} (aim: {aims})"


def _written(name: str, folder: Path) -> list[str]:
    """Write what a command reads; the options that keep it short."""
    if name == "bench":
        (folder / "bench.toml").write_text(_BENCH.replace("EXPERIMENTS", str(ROOT / "experiments")), "utf-8")
    if name != "trace":
        return []
    shutil.copytree(ROOT / "experiments" / "sample", folder / "sample")
    for path in (folder / "sample").glob("*.csv.gz"):
        rows = gzip.decompress(path.read_bytes()).splitlines(keepends=True)
        path.write_bytes(gzip.compress(b"".join(rows[: _ROWS + 1])))
    from workbench.commands.list.catalogue import listing

    return ["--without", *sorted({row["name"] for row in listing("effects")} - {_EFFECT})]


def sizes() -> list[str]:
    """The lines of Python of the house, of its largest room, of the commands and of the tests."""
    rooms = [path for path in (ROOT / "workbench").iterdir() if path.is_dir()]
    house, (lines, largest) = (
        sum(map(_lines, OWN)),
        max((_lines(f"workbench/{path.name}"), path.name) for path in rooms),
    )
    return [
        f"workbench, controllers and envs: {house} lines (aim: 72000)",
        f"the largest room, {largest}: {lines} lines, {lines / house:.0%} of them (aim: 25%)",
        f"commands: {_lines('workbench/commands')} lines (aim: 18000)",
        f"tests: {_lines('tests')} lines (aim: 33000)",
    ]


def _lines(folder: str) -> int:
    return sum(len(path.read_text("utf-8").splitlines()) for path in (ROOT / folder).rglob("*.py"))


def main(names: Sequence[str]) -> int:
    """Print the walks and the sizes, or one walk by its name."""
    if names:
        with tempfile.TemporaryDirectory() as folder:
            print(line(names[0], Path(folder)))
        return 0
    for name in WAYS:
        with tempfile.TemporaryDirectory() as empty:
            call, empty_cache = [sys.executable, __file__, name], {"PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": empty}
            subprocess.run(call, env={**os.environ, **empty_cache}, check=True)
    print("\n".join(sizes()))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
