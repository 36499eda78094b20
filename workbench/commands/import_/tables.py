"""Files converted to strict tables in a folder, and what their columns are."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...base.files import name_problem
from ...base.signals import SIGNALS
from ...identify.columns.guess import ColumnGuess
from ...identify.columns.summary import ColumnSummary, summary
from ...records.columns import HELD, LINEAR, beside
from ...records.foreign import ConvertedTable, column, open_foreign, renamed, write_parts
from ...records.foreign.open import suffix_of
from ...records.foreign.unit_names import name_of
from ..common.outcome import Progress


def converted(files: Sequence[Path], folder: Path, progress: Progress) -> list[ConvertedTable]:
    """Every file as one strict table or several in `folder`, named as the file is. Raises InputError."""
    parts: list[ConvertedTable] = []
    names: set[str] = set()
    for path in files:
        progress(f"reading {path.name}")
        name = _name(path, names)
        names.add(name)
        parts += write_parts(open_foreign(path), path, folder, name)
    return parts


def _name(path: Path, taken: set[str]) -> str:
    """The file's name without its suffix, and with a number where another file has it."""
    plain = path.name[: -len(suffix_of(path))].strip() or "record"
    if problem := name_problem(plain):
        raise InputError(f"{path}: {problem}; rename the file")
    name, again = plain, 1
    while name in taken:
        again += 1
        name = f"{plain}-{again}"
    return name


def summaries(parts: Sequence[ConvertedTable], folder: Path) -> list[ColumnSummary]:
    """What every column of the tables is, over all that have it, in the order of the tables; one in memory at once.

    Raises InputError for a column that has one unit in one file and another in the next.
    """
    units: dict[str, str | None] = {}
    ways: dict[str, str | None] = {}
    for part in parts:
        cells = {heading.cell for heading in part.headings}
        other_ways = {beside(cell, way) for cell in cells for way in (HELD, LINEAR)}
        for heading in part.headings:
            if heading.cell in other_ways:
                continue
            ways[heading.cell] = ways.get(heading.cell) or heading.between
            known = units.setdefault(heading.cell, heading.unit)
            if known != heading.unit:
                both = f"{known or 'no unit'} in one file and {heading.unit or 'no unit'} in {part.origin}"
                raise InputError(f'{part.origin}: column "{heading.cell}" is in {both}; import the files one by one')

    def records(cell: str) -> Iterator[tuple[str, np.ndarray]]:
        for part in parts:
            if any(heading.cell == cell for heading in part.headings):
                yield part.file, column(folder / part.file, cell)

    return [summary(cell, unit, records(cell), ways[cell]) for cell, unit in units.items()]


def set_apart(guesses: Sequence[ColumnGuess], parts: Sequence[ConvertedTable], folder: Path) -> dict[str, str]:
    """Rename columns that are left out but called like a signal, as which they would be read; new cells by old."""
    cells = {}
    for guess in guesses:
        name = name_of(guess.column.cell)
        if name in SIGNALS and guess.signal != name:
            cells[guess.column.cell] = guess.column.cell.replace(name, f"{name} as recorded", 1)
    for part in parts if cells else ():
        renamed(folder / part.file, cells)
    return cells
