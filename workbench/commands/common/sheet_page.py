"""A sheet as a page: its lines with limits, where to sign, and what making it again needs; printed where asked."""

import argparse
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...base.errors import InputError
from ...base.words import counted
from ...identify.acceptance.row import Row
from ...report import Page, Section, Table, within
from ...report.table import Cell
from .outcome import Outcome
from .sheet_options import Made

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
_SECONDS = 120
_DATES, _DATE = re.compile(rb"(/(?:CreationDate|ModDate) \(D:)([^)]*)"), b"19700101000000+00'00'"
_NAMED = 3  # lines that a verdict names


def sheet_page(title: str, made: Made, rows: Sequence[Row], sections: Sequence[Section], how: str) -> Page:
    """The page of a sheet: lines, then what belongs to it, then digests and signatures."""
    own = [Section("Lines", [_lines(rows), *([_missing(rows)] if any(r.value is None for r in rows) else [])])]
    last = Section("Signed", [_signatures(), _files(made.digests) if made.digests else _bundled(made.of), how])
    footer = {} if made.seed is None else {"seed": str(made.seed)}
    return Page(title, verdict(rows), [*own, *sections, last], footer)


def printed(options: argparse.Namespace, outcome: Outcome, name: str) -> None:
    """Print the report of a finished sheet into sheet.pdf beside it, where that is asked for. Raises InputError."""
    if not options.pdf:
        return
    out = options.out or Path("out") / name
    print_pdf(out / "report.html", out / "sheet.pdf")
    print(f"pdf: {out / 'sheet.pdf'}, printed by {Path(browser()).name}")


def browser() -> str:
    """The installed browser that prints. Raises InputError where there is none."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        raise InputError(f"--pdf: no {BROWSERS[0]} is installed to print the page; print report.html from a browser")
    return found


def print_pdf(page: Path, pdf: Path) -> None:
    """A page as PDF by a browser without a window. Raises InputError where it fails."""
    with tempfile.TemporaryDirectory() as profile:
        command = [
            browser(), "--headless", "--disable-gpu", "--no-sandbox", f"--user-data-dir={profile}",
            "--no-pdf-header-footer", "--virtual-time-budget=10000", f"--print-to-pdf={pdf.resolve()}",
            page.resolve().as_uri(),
        ]  # fmt: skip
        try:
            subprocess.run(command, capture_output=True, timeout=_SECONDS, check=True)
        except (OSError, subprocess.SubprocessError) as error:
            raise InputError(
                f"--pdf: {command[0]} did not print {page} ({type(error).__name__}); print it by hand"
            ) from None
    if not pdf.exists():
        raise InputError(f"--pdf: {command[0]} left no {pdf}; print {page} by hand")
    pdf.write_bytes(undated(pdf.read_bytes()))


def undated(pdf: bytes) -> bytes:
    """A PDF whose dates are one and the same: it is signed with a date, and made again to the byte."""
    return _DATES.sub(lambda found: found[1] + _DATE.ljust(len(found[2])), pdf)


def verdict(rows: Sequence[Row]) -> str:
    """How many lines are said, and how many pass."""
    said, judged = [r for r in rows if r.value is not None], [r for r in rows if r.passed is not None]
    failed = [row.id for row in judged if not row.passed]
    empty = [row.id for row in rows if row.limited and row.passed is None]
    words = (
        f"{len(said)} of {len(rows)} lines have a value." if len(said) < len(rows) else f"{counted(len(rows), 'line')}."
    )
    if not judged and not empty:
        return f"{words} No limits were given."
    if failed:
        words += f" Of {len(judged)} with limits {len(failed)} fail: {_named(failed)}."
    elif judged:
        words += f" All {len(judged)} with limits{' and a value' * bool(empty)} pass."
    return words + (f" Limits of lines without a value judge nothing: {_named(empty)}." if empty else "")


def _named(ids: Sequence[str]) -> str:
    return ", ".join(ids[:_NAMED]) + (" and others" if len(ids) > _NAMED else "")


def _lines(rows: Sequence[Row]) -> Table:
    """To the digits that intervals tell; without the columns of limits where there are none."""
    said = [row for row in rows if row.value is not None]
    limited = any(row.maker is not None or row.passed is not None for row in said)
    cells = [
        [row.meaning, *_interval(row), row.unit, *([row.maker, _passes(row)] if limited else []), row.id]
        for row in said
    ]
    head = ["line", "value", "low", "high", "unit", *(["maker", "passes"] if limited else []), "id"]
    note = "Low and high: 95 % for each line alone. A line passes where its whole interval lies within the limits."
    return Table("What was found", head, cells, note)


def _interval(row: Row) -> list[Cell]:
    if row.value is None or row.low is None or row.high is None:
        return [row.value, row.low, row.high]
    return list(within(row.value, row.low, row.high))


def _passes(row: Row) -> str:
    return "" if row.passed is None else "pass" if row.passed else "FAIL"


def _missing(rows: Sequence[Row]) -> Table:
    return Table(
        "What cannot be said", ["line", "why", "id"], [[r.meaning, r.reason, r.id] for r in rows if r.value is None]
    )


def _signatures() -> Table:
    blank = "_" * 24
    return Table(
        "", ["", "name", "date", "signature"], [[who, blank, blank, blank] for who in ("measured by", "approved by")]
    )


def _files(digests: Mapping[str, str]) -> Table:
    return Table("Files that this sheet is made of", ["file", "SHA-256"], [list(item) for item in digests.items()])


def _bundled(name: str) -> str:
    return f"{name} comes with jackbench; the versions below say which one it was."
