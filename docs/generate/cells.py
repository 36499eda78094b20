"""Blocks of a page that run when the site is built; what they print and draw stands below them.

A fence is one of

    {python}      lines of Python; the blocks of a page share their names, and the last expression shows itself
    {shell}       lines of a shell
    {file} NAME   a text that is written beside them as NAME

The blocks of a page run in its order, in a folder of the page's own. Pictures that a block leaves there are shown.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from .examples import source_digest
from .readme import ROOT

_FENCE = re.compile(r"^(`{3,})\{(python|shell|file)\}[ \t]*(\S*)\n(.*?)^\1[ \t]*$", re.MULTILINE | re.DOTALL)
_LANGUAGES = {"toml": "toml", "py": "python", "csv": "text"}
_AT_ONCE = 2
_LONGEST = 900  # s of a page
_DRIVER = Path(__file__).parent / "run_cells.py"


@dataclass(frozen=True)
class Cell:
    """A block of a page: its kind, the name of its file if it is one, and its text."""

    kind: str
    name: str
    text: str


def cells(page: str) -> list[Cell]:
    """The blocks of a page that run, in order."""
    return [Cell(match[2], match[3], match[4]) for match in _FENCE.finditer(page)]


def parts(page: str) -> Iterator[str | Cell]:
    """A page as its words and its blocks, in turn."""
    at = 0
    for match in _FENCE.finditer(page):
        yield page[at : match.start()]
        yield Cell(match[2], match[3], match[4])
        at = match.end()
    yield page[at:]


def setup(app: Any) -> dict[str, bool]:
    """Have Sphinx run the pages before it reads any, and show what they left."""
    app.connect("builder-inited", _run_all)
    app.connect("source-read", _shown)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _run_all(app: Any) -> None:
    docs = Path(app.srcdir)
    run_pages(docs, page_paths(docs), docs / "_build" / "ran")


def page_paths(docs: Path) -> list[Path]:
    """The pages of the site that are written by hand."""
    return sorted(path for path in docs.rglob("*.md") if path.relative_to(docs).parts[0] not in ("_build", "reference"))


def run_pages(docs: Path, pages: Iterable[Path], cache: Path) -> None:
    """Run the blocks of pages that have some and that have changed, or whose code has. Raises RuntimeError."""
    sources = source_digest()
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        list(pool.map(lambda page: _run(page.read_text("utf-8"), _folder(docs, page, cache), sources), pages))


def _folder(docs: Path, page: Path, cache: Path) -> Path:
    return cache / page.relative_to(docs).with_suffix("")


def _run(text: str, folder: Path, sources: bytes) -> None:
    asked = [vars(cell) for cell in cells(text)]
    if not asked:
        return
    key = sha256(json.dumps(asked).encode() + _DRIVER.read_bytes() + sources).hexdigest()
    kept = folder / "key.txt"
    if kept.exists() and kept.read_text("utf-8") == key:
        return
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "made").mkdir(parents=True)
    (folder / "cells.json").write_text(json.dumps(asked), "utf-8")
    _drive(folder)
    kept.write_text(key, "utf-8")


def _drive(folder: Path) -> None:
    """Run the blocks as a user would, who has trusted nothing. Raises RuntimeError for one that fails."""
    inherited = {name: value for name, value in os.environ.items() if name != "JACKBENCH_TRUSTED"}
    path = f"{Path(sys.executable).parent}{os.pathsep}{inherited.get('PATH', '')}"
    paths = {"PATH": path, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg", "COLUMNS": "110"}
    call = [sys.executable, str(_DRIVER), str(folder / "cells.json"), str(folder / "left.json")]
    run = subprocess.run(
        call,
        cwd=folder / "made",
        env={**inherited, **paths},
        capture_output=True,
        text=True,
        timeout=_LONGEST,
        check=False,
    )
    if run.returncode:
        raise RuntimeError(f"{folder.name}: {(run.stderr.strip() or run.stdout.strip())[-2000:]}")


def _shown(app: Any, name: str, source: list[str]) -> None:
    """Put below each block what it left."""
    if not cells(source[0]):
        return
    folder = Path(app.srcdir) / "_build" / "ran" / name
    left = iter(json.loads((folder / "left.json").read_text("utf-8")))
    at = f"/_build/ran/{name}/made"
    source[0] = "".join(part if isinstance(part, str) else _block(part, next(left), at) for part in parts(source[0]))


def _block(cell: Cell, left: dict[str, Any], at: str) -> str:
    language = "sh" if cell.kind == "shell" else "python" if cell.kind == "python" else ""
    language = language or _LANGUAGES.get(cell.name.rpartition(".")[2], "text")
    shown = [f"`{cell.name}`:"] if cell.name else []
    shown.append(f"```{language}\n{cell.text}```")
    if printed := left["printed"].rstrip():
        shown.append(f"```{{code-block}} text\n:class: printed\n\n{printed}\n```")
    shown += [f"```{{image}} {at}/{picture}\n:alt: what the lines above draw\n```" for picture in left["pictures"]]
    return "\n\n".join(shown)
