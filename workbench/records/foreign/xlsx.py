"""Excel workbooks, read by openpyxl row by row: the first sheet with a table is taken as lines of text."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any, BinaryIO

from ...base.errors import InputError, short_path
from .csv_text import read_text
from .optional import needed
from .source import Source

_LEAST = 3  # rows of a sheet that may hold a table


def read_xlsx(path: Path) -> Source:
    """The table of a workbook. Raises InputError where openpyxl is missing, and where there is no table."""
    openpyxl = needed("openpyxl", "xlsx")
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: "\n".join(_lines(sheet)) for sheet in book.worksheets}
        book.close()
    except Exception as error:  # of the library: InvalidFileException, BadZipFile, KeyError, ParseError ...
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{short_path(path)}: broken workbook ({reason}); save it again as .xlsx") from None
    title = max(sheets, key=lambda name: sheets[name].count("\n"), default="")
    if sheets.get(title, "").count("\n") < _LEAST:
        raise InputError(f"{short_path(path)}: no sheet with a table; put one row a sample under a header")
    content = sheets[title].encode()

    @contextmanager
    def opened() -> Iterator[BinaryIO]:
        yield io.BytesIO(content)

    source = read_text(path, opened)
    source.notes[:] = [note for note in source.notes if note != "cells separated by tabs"]
    if len(sheets) > 1:
        source.notes.append(f'sheet "{title}" is read, of {len(sheets)}')
    return source


def _lines(sheet: Any) -> Iterator[str]:
    for row in sheet.iter_rows(values_only=True):
        yield "\t".join(map(_cell, row))


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | date | time):
        return value.isoformat().replace("T", " ")
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, bool | int | float):
        return repr(float(value))
    return " ".join(str(value).split())
