"""One HTML page that lists finished runs, each with its verdict and what lies in its folder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from urllib.parse import quote

from ..base.words import counted
from .page import html_page

MARK = '<meta name="generator" content="jackbench">'  # what an index of ours has in its text
_COLUMNS = ("run", "verdict", "rig and experiment", "files", "next")


@dataclass(frozen=True)
class FinishedRun:
    """A run folder beside the index: `name`, its title, verdict, rig, date and command where its config says them.

    files: those in the folder, by what they are: "rig", "experiment" and others by their own names. next: a command.
    """

    name: str
    title: str = ""
    verdict: str = ""
    rig: str = ""
    date: str = ""
    command: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    tables: int = 0
    next: str = ""


def index_html(runs: Sequence[FinishedRun]) -> str:
    """The page, runs in the order given."""
    head = "".join(f'<th scope="col">{name}</th>' for name in _COLUMNS)
    rows = "\n".join(_row(run) for run in runs)
    count = f"{len(runs)} finished run{'' if len(runs) == 1 else 's'}, the latest first."
    return html_page(
        "jackbench: runs",
        f'{MARK}\n<header>\n<h1>Runs</h1>\n<p class="verdict">{count}</p>\n</header>\n'
        f'<main class="runs">\n<table><thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody></table>\n</main>\n',
    )


def _row(run: FinishedRun) -> str:
    title = f"<br>{escape(run.title)}" if run.title else ""
    date = f'<br><span class="when">{escape(run.date)}</span>' if run.date else ""
    command = f"<br><code>{escape(run.command)}</code>" if run.command else ""
    cells = (
        f"{_link(run.name, 'report.html', run.name)}{title}{date}",
        f"{escape(run.verdict) or '–'}{command}",
        f"{escape(run.rig)}{'<br>' if run.rig else ''}{_links(run, 'rig', 'experiment')}",
        "<br>".join(filter(None, (_others(run), f"{counted(run.tables, 'table')} (*.parquet)" if run.tables else ""))),
        f"<code>{escape(run.next)}</code>" if run.next else "",
    )
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _links(run: FinishedRun, *kinds: str) -> str:
    return ", ".join(_link(run.name, run.files[kind], kind) for kind in kinds if kind in run.files)


def _others(run: FinishedRun) -> str:
    return _links(run, *(kind for kind in run.files if kind not in ("rig", "experiment")))


def _link(folder: str, file: str, text: str) -> str:
    return f'<a href="{quote(folder)}/{quote(file)}">{escape(text)}</a>'
