"""How a text file of numbers is laid out: encoding, separator, decimal sign, lines before the table, header, units."""

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from ...base.errors import InputError, echo, short_path
from ...base.words import counted
from ..table import MISSING
from .source import Heading, unique_headings
from .stamps import is_stamp
from .unit_names import heading_of, is_unit, plain_unit

BLANKS = " "  # runs of blanks and tabs
_DELIMITERS = ("\t", ";", ",", "|", BLANKS)
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|[+-]?inf(?:inity)?", re.IGNORECASE)
_MISSING = {*MISSING, "-", "--", "---"}
_MARKS = ("#", "%", "//", "!")  # before a line that is a comment
_SIDE = re.compile(r"[AB12]", re.IGNORECASE)
_WORD = re.compile(r"[^\W\d_]{3}")
_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")  # as the parser ends them: not at form feeds
_MOST_BREAKS = 20  # lines of a row
_DOUBLE = 15  # digits of whole numbers that a double has
_SURE_ROWS = 3  # rows of numbers in a row: there the table begins
_RATE = re.compile(
    r"\b(?:sampl\w*|abtast|scan|taux|fr[eé]quence d.[eé]chantillonnage|fs)\w*[ _]*(?:rate|frequency|freq|frequenz)?"
    r"\s*(?:[\[(]\s*(?P<before>k?hz|m?s)\s*[\])])?\s*[:=;,\t ]+\s*(?P<number>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)"
    r"[;,\t ]*(?P<after>k?hz|[mµu]?s\b)?",
    re.IGNORECASE,
)
_PERIODS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}


@dataclass(frozen=True)
class CsvShape:
    """Layout of a text file. `kinds` are "number", "stamp", "digits" (more than a double has) or "text" by column;
    `left` are those of text with a cell of each; `skipped` lines come before the rows.

    period        s from row to row, where a line before the table says it
    plus          numbers have plus signs
    feeds         there are form feeds
    broken_cells  cells in quotes may have line breaks
    remarked      some rows have one cell more
    """

    encoding: str
    delimiter: str
    decimal: str
    skipped: int
    headings: tuple[Heading, ...]
    kinds: tuple[str, ...]
    left: tuple[str, ...]
    period: float | None
    plus: bool
    feeds: bool
    broken_cells: bool
    remarked: bool
    notes: tuple[str, ...]


def csv_shape(path: Path, head: bytes, whole: bool, known: str | None = None) -> CsvShape:
    """The layout, from the first bytes of a file; `whole`: these are all; `known`: the separator, where it is.

    Raises InputError where there is no table.
    """
    encoding = _encoding(head)
    text = head.decode(encoding, errors="replace").lstrip("\ufeff")
    lines = _LINE.findall(text)
    lines = lines if whole or len(lines) < 2 else lines[:-1]  # the last one may be cut
    splits = [(delimiter, *_rows(lines, delimiter)) for delimiter in ((known,) if known else _DELIMITERS)]
    delimiter, rows, ends = max(splits, key=lambda split: _score(split[1]))
    width = _width(rows)
    body = _body(rows, width)
    if body is None:
        raise InputError(
            f"{short_path(path)}: no table of numbers in its first {len(lines)} lines; export rows of "
            "numbers under a header"
        )
    full = [row for row in rows[body:] if len(row) == width]
    kinds = _kinds(full, width)
    remarks = [row[width] for row in rows[body:] if _is_remarked(row, width)]
    cells = [cell for row in rows[body:] for cell in row]
    headings, header_lines = _headings(path, rows[:body], width)
    notes = [f"{counted(body - header_lines, 'line')} before the table"] if body > header_lines else []
    notes += [f"left out, remarks beside some rows: {echo(remarks[0])}"] if remarks else []
    return CsvShape(
        encoding=encoding,
        delimiter=delimiter,
        decimal=_decimal(cells),
        skipped=ends[body - 1] if body else 0,
        headings=headings,
        kinds=kinds,
        left=tuple(_with_cell(headings[k].cell, (row[k] for row in full)) for k in range(width) if kinds[k] == "text"),
        period=_period("".join(lines[: ends[body - 1] if body else 0])),
        plus=any(cell.startswith("+") for cell in cells),
        feeds="\f" in text,
        broken_cells=ends[-1] - ends[body] > len(rows) - 1 - body,
        remarked=bool(remarks),
        notes=(*notes, *_said(encoding, delimiter, _decimal(cells), known)),
    )


def _encoding(head: bytes) -> str:
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if b"\0" in head[:200]:
        return "utf-16-le" if head[1:200:2].count(0) > head[0:200:2].count(0) else "utf-16-be"
    for end in range(4):  # a character may be cut
        try:
            head[: len(head) - end].decode("utf-8")
        except UnicodeDecodeError:
            continue
        return "utf-8"
    try:
        head.decode("cp1252")
    except UnicodeDecodeError:
        return "latin-1"
    return "cp1252"


def _rows(lines: Sequence[str], delimiter: str) -> tuple[list[list[str]], list[int]]:
    """The rows, and the number of lines up to the end of each: a row with line breaks in quotes takes several."""
    rows: list[list[str]] = []
    ends = [0]
    while ends[-1] < len(lines):
        cells, taken = _row(lines[ends[-1] : ends[-1] + _MOST_BREAKS], delimiter)
        rows.append([" ".join(cell.split()) for cell in cells])
        ends.append(ends[-1] + taken)
    return rows, ends[1:]


def _row(lines: Sequence[str], delimiter: str) -> tuple[list[str], int]:
    """The cells of the first row, and how many lines it takes."""
    if delimiter == BLANKS:
        return lines[0].split(), 1
    if '"' not in lines[0]:
        return lines[0].split(delimiter), 1
    reader = csv.reader(lines, delimiter=delimiter, strict=True)
    try:
        return next(reader), reader.line_num
    except csv.Error:
        return lines[0].split(delimiter), 1


def _is_number(cell: str) -> bool:
    return bool(_NUMBER.fullmatch(cell))


def _score(rows: Sequence[Sequence[str]]) -> int:
    """Numbers and stamps in rows of the most frequent width, a date and the time after it as one: the right separator
    gives most."""
    width = _width(rows)
    numeric = [[_is_number(cell) or 2 * is_stamp(cell) for cell in row] for row in rows if len(row) == width]
    return sum(sum(map(bool, row)) - sum(map((2, 2).__eq__, pairwise(row))) for row in numeric)


def _width(rows: Sequence[Sequence[str]]) -> int:
    widths = Counter(len(row) for row in rows if any(map(_is_number, row)))
    return max(widths, key=lambda width: (widths[width], width), default=0)


def _body(rows: Sequence[Sequence[str]], width: int) -> int | None:
    """The first row of the table: from it on, rows are numbers."""
    numeric = [(len(row) == width and _is_body(row)) or _is_remarked(row, width) for row in rows]
    for first, good in enumerate(numeric):
        ahead = numeric[first : first + _SURE_ROWS]
        if good and all(ahead):
            return first
    return None


def _is_remarked(row: Sequence[str], width: int) -> bool:
    """Whether a row of the table has a remark behind it, as loggers put an event beside its row alone."""
    return len(row) == width + 1 > 2 and _is_body(row[:width]) and not _is_number(row[width]) and row[width] != ""


def _is_body(row: Sequence[str]) -> bool:
    filled = [cell for cell in row if cell.lower() not in _MISSING]
    numbers = sum(_is_number(cell) or is_stamp(cell) for cell in filled)
    return numbers > 0 and 2 * numbers >= len(filled)


def _with_cell(name: str, column: Iterable[str]) -> str:
    """A column with what it holds, for a note."""
    cell = next((cell for cell in column if cell), "")
    return f"{name} ({echo(cell)})" if cell else name


def _kinds(rows: Sequence[Sequence[str]], width: int) -> tuple[str, ...]:
    kinds = []
    for column in zip(*rows, strict=True) if rows else [()] * width:
        filled = [cell for cell in column if cell.lower() not in _MISSING]
        numbers, stamps = sum(map(_is_number, filled)), sum(map(is_stamp, filled))
        long = bool(filled) and all(len(cell) > _DOUBLE and cell.isdecimal() for cell in filled)
        kind = "number" if 2 * numbers >= len(filled) else "stamp" if 2 * stamps >= len(filled) else "text"
        kinds.append("digits" if long else kind)
    return tuple(kinds)


def _decimal(cells: Sequence[str]) -> str:
    numbers = [cell for cell in cells if _is_number(cell)]
    return "," if sum("," in cell for cell in numbers) > sum("." in cell for cell in numbers) else "."


def _headings(path: Path, above: Sequence[Sequence[str]], width: int) -> tuple[tuple[Heading, ...], int]:
    """Headings from the lines above the table, and how many lines they take."""
    above = [_without_mark(row, width) for row in above if any(row)]
    titles = [row for row in above[-2:] if width <= len(row) <= width + 1]
    if not titles or len(titles[-1]) < width:
        if above and width == 2 * len(above[-1]) > 2:
            raise InputError(
                f"{short_path(path)}: {width} cells under a header of {len(above[-1])}: commas both in numbers and "
                "between them; export with semicolons between cells"
            )
        return unique_headings([Heading("")] * width), 0
    last = titles[-1][:width]
    if len(titles) == 2 and _are_units(last):
        units = [plain_unit(cell) if cell else None for cell in last]
        own, groups = titles[0], above[-3] if len(above) > 2 else []
        names = [Heading(cell, unit or heading_of(cell).unit) for cell, unit in zip(own, units, strict=False)]
        return unique_headings(in_groups(names, groups)), 2
    groups = above[-2] if len(above) > 1 else []
    return unique_headings(in_groups([heading_of(cell) for cell in last], groups)), 1


def in_groups(headings: Sequence[Heading], groups: Sequence[str]) -> list[Heading]:
    """Headings with the name of their group, "Pressures" over "A" and "B", before those that say a side alone.

    A group's name stands over its first column; the cells to its right are empty, up to the next group's.
    """
    if not len(headings) <= len(groups) <= len(headings) + 1 or not any(groups) or all(groups):
        return list(headings)
    named, group = [], ""
    for heading, cell in zip(headings, groups, strict=False):
        group = cell.strip() if _WORD.search(cell) else group
        alone = bool(_SIDE.fullmatch(heading.cell.strip())) and bool(group)
        named.append(Heading(f"{group} {heading.cell.strip()}", heading.unit) if alone else heading)
    return named


def _without_mark(row: Sequence[str], width: int) -> Sequence[str]:
    """A line above the table without the mark of a comment."""
    if len(row) == width + 1 and row[0] in _MARKS:
        return row[1:]
    mark = next((mark for mark in _MARKS if row[0].startswith(mark)), "")
    return [row[0].removeprefix(mark).strip(), *row[1:]]


def _are_units(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return bool(filled) and 2 * sum(map(is_unit, filled)) > len(filled)


def _period(text: str) -> float | None:
    """Seconds from row to row, of a line such as "Sample rate: 1000 Hz"."""
    for match in _RATE.finditer(text):
        number = float(match["number"].replace(",", "."))
        unit = (match["after"] or match["before"] or "").lower()
        if number > 0 and unit:
            return number * _PERIODS[unit] if unit in _PERIODS else 1.0 / (number * (1e3 if unit == "khz" else 1.0))
    return None


def _said(encoding: str, delimiter: str, decimal: str, known: str | None) -> list[str]:
    names = {"\t": "tabs", ";": "semicolons", "|": "bars", BLANKS: "blanks"}
    said = [f"read as {encoding}"] if encoding != "utf-8" else []
    said += [f"cells separated by {names[delimiter]}"] if delimiter in names and not known else []
    return said + (["decimal commas"] if decimal == "," else [])
