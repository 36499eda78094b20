"""Figures, tables and pages where a person looks: a notebook's cell, a browser, a file."""

import os
import sys
import tempfile
from base64 import b64encode
from html import escape
from pathlib import Path

from ..base.desktop import show_file
from ..base.errors import InputError
from ..base.files import check_place
from .figures import Figure
from .page import Page, Section, write_page
from .table import Table, shown

_CELL = 'style="text-align:right;padding:2px 8px"'


def figure_html(figure: Figure) -> str:
    """The figure as an image that carries its SVG: it needs no script and no network, in a saved notebook either."""
    from .still import svg_text

    data = b64encode(svg_text(figure).encode()).decode()
    note = f'<div style="color:#57606a;font-size:small">{escape(figure.note)}</div>' if figure.note else ""
    return f'<img alt="{escape(figure.title)}" style="max-width:860px" src="data:image/svg+xml;base64,{data}">{note}'


def small_table_html(table: Table) -> str:
    """The table without the scripts and style of a page."""
    head = "".join(f"<th {_CELL}>{escape(name)}</th>" for name in table.columns)
    rows = "".join(
        "<tr>" + "".join(f"<td {_CELL}>{escape(shown(cell))}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    caption = f'<caption style="text-align:left">{escape(table.title)}</caption>' if table.title else ""
    return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a .png, .svg or interactive .html file. Raises InputError for another suffix and a missing folder."""
    path = Path(path)
    check_place(path)
    if path.suffix == ".html":
        write_page(figure_page(figure), path)
    elif path.suffix in (".png", ".svg"):
        from .still import still_picture

        still_picture(figure, path)
    else:
        raise InputError(f"{path}: a figure is saved as .png, .svg or .html")
    return path


def show_figure(figure: Figure) -> Path | None:
    """Display the figure in a notebook, else open it in a browser; the path of the page then."""
    if _in_notebook():
        from IPython.display import display  # pyright: ignore[reportMissingImports]

        display(figure)
        return None
    return open_page(figure_page(figure))


def figure_page(figure: Figure) -> Page:
    """A page with one figure."""
    return Page(figure.title, figure.note, [Section("Figure", [figure])])


def open_page(page: Page) -> Path:
    """Write the page to a temporary file, and open it where there is a desktop to open it on; its path."""
    handle, name = tempfile.mkstemp(".html", "jackbench-")
    os.close(handle)
    path = Path(name)
    write_page(page, path)
    show_file(path)
    return path


def _in_notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")
