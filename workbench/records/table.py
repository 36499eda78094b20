"""Files as tables of numbers: .csv, .csv.gz, .parquet, .mat. Units and meanings come later, in `read`."""

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.contained import contained
from ..base.errors import InputError, clipped, echo
from ..base.files import check_numbers, open_file, read_bytes
from .mat import vectors

if TYPE_CHECKING:
    import pyarrow

FORMATS = (".csv", ".csv.gz", ".parquet", ".mat")
_MOST_COLUMNS, _LONGEST_CELL = 2000, 200
MISSING = ("", "nan", "-nan", "na", "n/a", "#n/a", "null", "none")
_SPELLED = sorted({text for word in MISSING for text in (word, word.upper(), word.capitalize())} | {"NaN", "-NaN"})


@dataclass(frozen=True)
class DataTable:
    """`read(cells)` gives those columns as [n] float, NaN where a cell is missing; `rows` are their row numbers.

    A row number is the line in a CSV file (the header is line 1), else the row of the table, from 1.
    """

    header: tuple[str, ...]
    rows: np.ndarray
    read: Callable[[Sequence[str]], dict[str, np.ndarray]]


def open_table(path: Path) -> DataTable:
    """Open a table by its suffix. Raises InputError for a missing, empty, broken or unknown file."""
    name = path.name.lower()
    with open_file(path, kind="record") as file:
        empty = not file.read(1)
    if not name.endswith(FORMATS):
        raise InputError(f"{path}: not a known kind of record; use one of {', '.join(FORMATS)}")
    if empty:
        raise InputError(f"{path}: the file is empty; record or export it again")
    kind = _parquet if name.endswith(".parquet") else _mat if name.endswith(".mat") else _csv
    return kind(path)


def cell_name(cell: str) -> str:
    """What a header cell is called, and quoted as: on one line, of at most 80 characters."""
    name = "".join(letter if letter.isprintable() else " " for letter in cell).strip()
    return clipped(name)


def _header(path: Path, cells: Sequence[str]) -> tuple[str, ...]:
    """The names of the header cells, of which a person can have made no more, and none longer."""
    if len(cells) > _MOST_COLUMNS:
        raise InputError(f"{path}: {len(cells)} columns; keep the {_MOST_COLUMNS} that matter, or fewer")
    for cell in map(str.strip, cells):
        if len(cell) > _LONGEST_CELL:
            raise InputError(f"{path}: column {echo(cell)}: a heading of {len(cell)} characters; shorten it")
    return tuple(map(cell_name, cells))


def _csv(path: Path) -> DataTable:
    lines = read_bytes(path, kind="record").removeprefix(b"\xef\xbb\xbf").splitlines()
    rows = np.array([number for number, line in enumerate(lines, 1) if line and not line.isspace()], dtype=int)
    if rows.size == 0:
        raise InputError(f"{path}: the file is empty; record or export it again")
    try:
        first = lines[rows[0] - 1].decode()
    except UnicodeDecodeError:
        raise InputError(f"{path}: row {rows[0]}: the header is not UTF-8 text; export it as UTF-8") from None
    if "," not in first and (";" in first or "\t" in first):
        raise InputError(
            f"{path}: row {rows[0]}: cells are not separated by commas; export with commas and decimal points"
        )
    header = _header(path, _cells(path, rows[0], first))
    body = [lines[number - 1] for number in rows[1:]]

    def read(cells: Sequence[str]) -> dict[str, np.ndarray]:
        import pyarrow as pa
        import pyarrow.csv as pacsv

        places = [header.index(cell) for cell in cells]
        names = [str(place) for place in range(len(header))]  # cells may repeat among the columns that are not read
        try:
            arrow = pacsv.read_csv(
                io.BytesIO(b"\n".join(body)),
                pacsv.ReadOptions(column_names=names, use_threads=False),
                convert_options=pacsv.ConvertOptions(
                    column_types={str(place): pa.float64() for place in places},
                    include_columns=[str(place) for place in places],
                    null_values=_SPELLED,
                ),
            )
        except pa.ArrowInvalid as error:
            raise _first_fault(path, header, places, rows[1:], body, str(error)) from None
        return {cell: _floats(arrow.column(str(place))) for cell, place in zip(cells, places, strict=True)}

    return DataTable(header, rows[1:], read)


def _first_fault(
    path: Path, header: tuple[str, ...], places: list[int], rows: np.ndarray, body: list[bytes], otherwise: str
) -> InputError:
    """The fast parser says that something is wrong; this slow one finds where, for the message."""
    for row, line in zip(rows, body, strict=True):
        cells = _cells(path, row, line.decode(errors="replace"))
        if len(cells) != len(header):
            return InputError(f"{path}: row {row}: {len(cells)} cells under a header of {len(header)}; mend the row")
        for place in places:
            if not _is_number(cells[place]):
                where = f'{path}: row {row}, column "{header[place]}"'
                return InputError(f"{where}: {echo(cells[place].strip())} is not a number; mend it or leave it empty")
    return InputError(f"{path}: cannot be read as a table of numbers ({echo(otherwise)}); export it again")


def _cells(path: Path, row: int, line: str) -> list[str]:
    reader = csv.reader([line, ""])
    try:
        cells = next(reader)
    except csv.Error as error:  # a cell too long for the csv module
        raise InputError(f"{path}: row {row}: {error}; export it again") from None
    if reader.line_num > 1:
        raise InputError(f"{path}: row {row}: a cell in quotes goes on in the next line; write each row on one line")
    return cells


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return text.strip().lower() in MISSING
    return "_" not in text  # which float() takes for 1_000


def _floats(column: "pyarrow.ChunkedArray") -> np.ndarray:
    return np.array(column.cast("float64", safe=False).to_numpy(), dtype=float)  # null becomes NaN


def _parquet(path: Path) -> DataTable:
    names, size, *columns = contained(_parquet_columns, path)
    header = _header(path, names)

    def read(cells: Sequence[str]) -> dict[str, np.ndarray]:
        out = {}
        for cell in cells:
            out[cell] = columns[header.index(cell)]
            if isinstance(out[cell], str):
                raise InputError(f'{path}: column "{cell}": holds {out[cell]}, not numbers; write it as numbers')
        return out

    return DataTable(header, np.arange(1, size + 1), read)


def _parquet_columns(path: Path) -> Iterator[list[str] | int | str | np.ndarray]:
    """The columns' names, the number of rows, and each column: its numbers [rows], or what it holds instead."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    with pq.ParquetFile(path) as file:  # which reads columns of one name, too
        check_numbers(path, file.metadata.num_rows * file.metadata.num_columns)
        table = file.read(use_threads=False)
    yield table.column_names
    yield table.num_rows
    for column in table.columns:
        kind = column.type
        is_numeric = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
        yield _floats(column) if is_numeric else str(kind)


def _mat(path: Path) -> DataTable:
    variables = dict(contained(vectors, path))
    arrays = dict(zip(_header(path, list(variables)), variables.values(), strict=True))

    def read(cells: Sequence[str]) -> dict[str, np.ndarray]:
        size = arrays[cells[0]].size
        for cell in cells:
            if arrays[cell].size != size:
                where = f'{path}: variable "{cell}"'
                raise InputError(f'{where}: {arrays[cell].size} samples but {size} in "{cells[0]}"; map another one')
        return {cell: np.array(arrays[cell], dtype=float) for cell in cells}

    return DataTable(tuple(arrays), np.arange(1, max((values.size for values in arrays.values()), default=0) + 1), read)
