"""One HTML page: self-contained, offline, a verdict and the picture that shows it on top, then sections."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from html import escape
from pathlib import Path

from .chart import chart, height, is_thinned
from .figures import Figure
from .glossary import glossary_html
from .palette import Look, looks
from .scene import Scene, scene_html
from .table import Table, table_html
from .thin import DRAWN_POINTS

__all__ = ["Page", "Section", "Table", "html_page", "page_looks", "render", "write_page"]

_DASHES = {"line": "", "points": "", "dash": ' stroke-dasharray="7 4"', "dot": ' stroke-dasharray="2 3"'}


@dataclass(frozen=True, eq=False)
class Section:
    """Figures, tables, scenes and paragraphs (plain text) under a heading."""

    title: str
    items: Sequence[Figure | Table | Scene | str]


@dataclass(frozen=True, eq=False)
class Page:
    """A report.

    verdict: the one sentence that answers the question. picture: the figure that shows it, drawn below it; a figure of
    the same title is not drawn again in a section. head: what was judged, when and by which command. footer: what doing
    it again needs (versions, seed).
    """

    title: str
    verdict: str
    sections: Sequence[Section]
    footer: Mapping[str, str] = field(default_factory=dict)
    head: Mapping[str, str] = field(default_factory=dict)
    picture: Figure | None = None

    @property
    def body(self) -> list[Section]:
        """The sections without the picture, and without a section of nothing else."""
        if self.picture is None:
            return list(self.sections)
        title = self.picture.title
        parts = [
            replace(part, items=[item for item in part.items if not (isinstance(item, Figure) and item.title == title)])
            for part in self.sections
        ]
        return [part for part, whole in zip(parts, self.sections, strict=True) if part.items or not whole.items]


def page_looks(page: Page) -> dict[str, Look]:
    """The look of every curve name of the page, in order of first appearance."""
    first = [] if page.picture is None else [page.picture]
    items = [item for section in page.body for item in section.items if isinstance(item, Figure)]
    return looks([*first, *items])


def render(page: Page) -> str:
    """The page as HTML: no request leaves it, and a name with markup in it is shown as text."""
    look = page_looks(page)
    sections = "".join(_section(section, index, look) for index, section in enumerate(page.body, 1))
    picture = _figure(page.picture, look) if page.picture is not None else ""
    plots = _scripts() if look else f"<script>{_asset('page.js')}</script>\n"
    if any(isinstance(item, Scene) for section in page.body for item in section.items):
        plots += f"<script>{_asset('scene.js')}</script>\n"
    head = _definitions(page.head)
    shown = (
        f'<header>\n<h1>{escape(page.title)}</h1>\n{head}<p class="verdict">{escape(page.verdict)}</p>\n</header>\n'
        f"{picture}{_contents(page)}<main>\n{sections}</main>\n"
    )
    return html_page(page.title, f"{shown}{glossary_html(shown)}{_footer(page)}{plots}")


def html_page(title: str, body: str) -> str:
    """A whole HTML page of our look, which makes no request; `body` is HTML."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; "
        "style-src 'unsafe-inline'; img-src data: blob:\">\n"
        f"<title>{escape(title)}</title>\n<style>\n{_asset('page.css')}</style>\n</head>\n<body>\n"
        f"{body}</body>\n</html>\n"
    )


def write_page(page: Page, path: Path) -> None:
    """Write the page, UTF-8."""
    path.write_text(render(page), encoding="utf-8", newline="\n")


def _contents(page: Page) -> str:
    if len(page.body) <= 3:
        return ""
    links = "".join(f'<li><a href="#s{i}">{escape(s.title)}</a></li>' for i, s in enumerate(page.body, 1))
    return f'<nav aria-label="Contents"><ol>{links}</ol></nav>\n'


def _section(section: Section, index: int, look: Mapping[str, Look]) -> str:
    return (
        f'<section id="s{index}">\n<h2>{escape(section.title)}</h2>\n'
        + "".join(
            f"<p>{escape(item)}</p>\n"
            if isinstance(item, str)
            else table_html(item)
            if isinstance(item, Table)
            else scene_html(item)
            if isinstance(item, Scene)
            else _figure(item, look)
            for item in section.items
        )
        + "</section>\n"
    )


def _figure(figure: Figure, look: Mapping[str, Look]) -> str:
    thinned = f"Drawn thinned to {DRAWN_POINTS} points a curve; every sample is in the *.parquet files."
    note = " ".join(filter(None, (figure.note, thinned if is_thinned(figure) else "")))
    # "<" cannot occur in JSON outside a string, where < means the same: no text can end the script element.
    data = json.dumps(chart(figure, look), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f'<figure class="item">\n<h3>{escape(figure.title)}</h3>\n<div class="chart">\n'
        f'<div class="plot" role="img" aria-label="{escape(figure.title)}" style="height:{height(figure)}px"></div>\n'
        f'{_legend(figure, look)}</div>\n<script type="application/json">{data}</script>\n'
        + (f'<figcaption class="note">{escape(note)}</figcaption>\n' if note else "")
        + "</figure>\n"
    )


def _legend(figure: Figure, look: Mapping[str, Look]) -> str:
    first = {}
    for panel in figure.panels:
        for curve in panel.curves:
            first.setdefault(curve.name, curve)
    keys = "".join(
        f'<li><button type="button" aria-pressed="{"true" if curve.visible else "false"}" data-name="{escape(name)}">'
        f"{_sample(look[name], look[name].style(curve.style))}<span>{escape(name)}</span></button></li>"
        for name, curve in first.items()
    )
    return f'<ul class="keys" title="Click: hide or show. Double click: only this one.">{keys}</ul>\n'


def _sample(look: Look, style: str) -> str:
    drawn = (
        f'<circle cx="14" cy="5" r="3" fill="{look.colour}"/>'
        if style == "markers"
        else f'<path d="M0 5H28" stroke="{look.colour}" stroke-width="2.2" fill="none"{_DASHES[style]}/>'
    )
    if style == "points":
        drawn += f'<circle cx="14" cy="5" r="3" fill="{look.colour}"/>'
    return f'<svg width="28" height="10" viewBox="0 0 28 10" aria-hidden="true">{drawn}</svg>'


def _footer(page: Page) -> str:
    return f"<footer>{_definitions(page.footer)}</footer>\n" if page.footer else ""


def _definitions(entries: Mapping[str, str]) -> str:
    rows = "".join(f"<div><dt>{escape(key)}</dt><dd>{escape(value)}</dd></div>" for key, value in entries.items())
    return f"<dl>{rows}</dl>\n" if rows else ""


def _scripts() -> str:
    return (
        "<noscript><p>The plots need JavaScript; the numbers are in metrics.json.</p></noscript>\n"
        f"<script>{_asset('plotly-basic.min.js')}</script>\n<script>{_asset('page.js')}</script>\n"
    )


@cache
def _asset(name: str) -> str:
    text = (Path(__file__).parent / "assets" / name).read_text(encoding="utf-8")
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")
