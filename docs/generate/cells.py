"""Blocks of a page that run when the site is built; what they print and draw stands below them.

A fence is one of

    {python}      lines of Python; the blocks of a page share their names, and the last expression shows itself
    {shell}       lines of a shell
    {file} NAME   a text that is written beside them as NAME

The blocks of a page run in its order, in a folder of the page's own. Pictures that a block leaves there are shown.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .runs import Cell, Run, run_all

_FENCE = re.compile(r"^(`{3,})\{(python|shell|file)\}[ \t]*(\S*)\n(.*?)^\1[ \t]*$", re.MULTILINE | re.DOTALL)
_LANGUAGES = {"toml": "toml", "py": "python", "csv": "text"}
_LEFT = re.compile(r"!\[([^\]]*)\]\((/_build/ran/[^)]+)\)")  # a picture that a block of another page left


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
    """Have Sphinx run the pages before it reads any, unless it builds the words alone, and show what they left."""
    app.connect("builder-inited", _run_all)
    app.connect("env-get-outdated", lambda app, *_: [run.name for run in page_runs(Path(app.srcdir))])
    app.connect("source-read", _show)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _run_all(app: Any) -> None:
    if not app.tags.has("words"):
        run_all(page_runs(Path(app.srcdir)))


def _show(app: Any, name: str, source: list[str]) -> None:
    source[0] = shown(Path(app.srcdir), name, source[0])


def page_runs(docs: Path) -> list[Run]:
    """The pages of the site that are written by hand and have blocks that run."""
    names = [path.relative_to(docs).with_suffix("") for path in sorted(docs.rglob("*.md"))]
    written = [str(name) for name in names if name.parts[0] not in ("_build", "reference")]
    return [run for name in written if (run := _run(docs, name, (docs / f"{name}.md").read_text("utf-8"))).cells]


def _run(docs: Path, name: str, page: str) -> Run:
    return Run(name, tuple(cells(page)), docs / "_build" / "ran" / name)


def shown(docs: Path, name: str, page: str) -> str:
    """A page with what each block left below it, and pictures of other pages' blocks, as far as they are there."""
    page = _LEFT.sub(lambda match: match[0] if (docs / match[2][1:]).exists() else f"({match[1]})", page)
    run = _run(docs, name, page)
    if not run.cells:
        return page
    left = iter(run.left() or [{"printed": "", "pictures": []}] * len(run.cells))
    at = f"/_build/ran/{name}/made"
    return "".join(part if isinstance(part, str) else _block(part, next(left), at) for part in parts(page))


def _block(cell: Cell, left: dict[str, Any], at: str) -> str:
    language = "sh" if cell.kind == "shell" else "python" if cell.kind == "python" else ""
    language = language or _LANGUAGES.get(cell.name.rpartition(".")[2], "text")
    shown = [f"`{cell.name}`:"] if cell.name else []
    shown.append(f"```{language}\n{cell.text}```")
    if printed := left["printed"].rstrip():
        shown.append(f"```{{code-block}} text\n:class: printed\n\n{printed}\n```")
    shown += [f"```{{image}} {at}/{picture}\n:alt: what the lines above draw\n```" for picture in left["pictures"]]
    return "\n\n".join(shown)
