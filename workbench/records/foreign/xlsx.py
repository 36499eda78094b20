"""Excel workbooks, read by openpyxl row by row: the first sheet with a table is taken as lines of text.

A cell is written so that it is read as what it is: a number with a point, a date as ISO 8601 has it.
"""

import csv
import io
import re
import zipfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any, BinaryIO

from ...base.errors import InputError, short_path
from ...base.files import MOST_READ, check_numbers
from ...base.words import counted
from .csv_text import read_text
from .optional import needed
from .source import Source

_LEAST = 3  # rows of a sheet that may hold a table
_PACKED = 30  # bytes of a cell, unpacked, or more
_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")  # a number that is typed as text
_RARE = 1000  # a column of the table has a cell in so many rows, or more


def read_xlsx(path: Path) -> Source:
    """The table of a workbook. Raises InputError where openpyxl is missing, and where there is no table."""
    openpyxl = needed("openpyxl", "xlsx")
    with zipfile.ZipFile(path) as packed:
        check_numbers(path, sum(part.file_size for part in packed.infolist()) // _PACKED, MOST_READ)
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    sheets = {sheet.title: _text(sheet) for sheet in book.worksheets}
    book.close()
    title = max(sheets, key=lambda name: sheets[name][0].count("\n"), default=None)
    if title is None or sheets[title][0].count("\n") <= _LEAST:
        raise InputError(f"{short_path(path)}: no sheet with a table; put one row a sample under a header")
    content = sheets[title][0].encode()

    @contextmanager
    def opened() -> Iterator[BinaryIO]:
        yield io.BytesIO(content)

    source = read_text(path, opened, delimiter="\t")
    if stray := sheets[title][1]:
        source.notes.append(f"left out, beyond the columns of the table: {counted(stray, 'cell')}")
    if len(sheets) > 1:
        source.notes.append(f'sheet "{title}" is read, of {len(sheets)}')
    return source


def _text(sheet: Any) -> tuple[str, int]:
    """The rows of the table in a sheet, whatever size the sheet says it has, and how many cells are beyond it."""
    sheet.reset_dimensions()
    filled: Counter[int] = Counter()
    rows = io.StringIO()
    write = csv.writer(rows, delimiter="\t").writerow
    for row in sheet.iter_rows(values_only=True):
        places = [place for place, value in enumerate(row) if value is not None]
        if places:
            filled.update(places)
            write(map(_cell, row))
    often = max(_LEAST, max(filled.values(), default=0) // _RARE)
    width = max((place + 1 for place, count in filled.items() if count >= often), default=0)
    text = io.StringIO()
    write = csv.writer(text, delimiter="\t", lineterminator="\n").writerow
    for row in csv.reader(io.StringIO(rows.getvalue(), newline=""), delimiter="\t"):
        if any(row[:width]):
            write(row[:width] + [""] * (width - len(row)))
    return text.getvalue(), sum(count for place, count in filled.items() if place >= width)


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | date | time):
        return value.isoformat().replace("T", " ")
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, bool | int | float):
        return repr(float(value))
    text = " ".join(str(value).split())
    return text.replace(",", ".") if _COMMA.fullmatch(text) else text
