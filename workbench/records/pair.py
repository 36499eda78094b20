"""Two columns of a recording, whatever they are called: what goes into something unknown, and what comes out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.errors import InputError, nearest
from ..base.units import converts, to_si
from . import repair
from .foreign import Heading, open_foreign
from .foreign.unit_names import name_of
from .foreign.vocabulary import strengths
from .record import Record

_FEWEST = 100  # rows


@dataclass(frozen=True, eq=False)
class RecordedPair:
    """A record of the columns `input` and `output`, in the `units` that the file says, "1" where it says none."""

    record: Record
    input: str
    output: str
    units: tuple[str, str]


def read_pair(path: str | Path, input: str, output: str) -> RecordedPair:
    """Two columns of a recording of any kind that `jackbench import` reads, by their names with or without unit.

    Raises InputError for a file without these columns or without a clock, and for too few rows of numbers.
    """
    path = Path(path)
    source = open_foreign(path)
    blocks = [list(block) for block in source.blocks]
    if not blocks:
        raise InputError(f"{path}: a header but no rows; record or export it again")
    columns = [np.concatenate(parts) for parts in zip(*blocks, strict=True)]
    cells = source.headings
    u, y = (_place(path, name, cells) for name in (input, output))
    rows = np.arange(1, columns[0].size + 1)
    clock = next((k for k, each in enumerate(cells) if "t" in strengths(name_of(each.cell))), None)
    if clock is None and source.period is None:
        known = ", ".join(f'"{each.cell}"' for each in cells)
        raise InputError(f"{path}: no column is a clock among {known}; add the time in seconds")
    t = (source.period or 0.0) * (rows - 1) if clock is None else _seconds(path, cells[clock], columns[clock])
    t, kept, notes = repair.good_times(path, rows, t, "t" if clock is None else cells[clock].cell)
    kept &= np.isfinite(t)
    known = {k: kept & np.isfinite(columns[k]) for k in (u, y)}
    whole = known[u] & known[y]
    if whole.sum() < _FEWEST:
        raise InputError(f"{path}: {whole.sum()} rows have both {input} and {output}; at least {_FEWEST} are needed")
    first, last = np.flatnonzero(whole)[[0, -1]]
    inside = kept & (rows - 1 >= first) & (rows - 1 <= last)
    signals = {name: np.interp(t[inside], t[known[k]], columns[k][known[k]]) for name, k in ((input, u), (output, y))}
    valid = {name: known[k][inside] for name, k in ((input, u), (output, y))}
    record = Record(path.name.split(".")[0], t[inside] - t[first], signals, valid, tuple(notes))
    return RecordedPair(record, input, output, (cells[u].unit or "1", cells[y].unit or "1"))


def _seconds(path: Path, heading: Heading, values: np.ndarray) -> np.ndarray:
    """A clock in s, of the unit that its heading says."""
    if heading.unit is None:
        return values
    if not converts(heading.unit, "s"):
        raise InputError(f'{path}: "{heading.cell}" is the clock, and "{heading.unit}" is no unit of time; mend it')
    return np.asarray(to_si(values, heading.unit, "s"), float)


def _place(path: Path, name: str, cells: tuple[Heading, ...]) -> int:
    """The column of that name: as its cell is, or as it is without its unit."""
    plain = [name_of(each.cell) for each in cells]
    found = [k for k, each in enumerate(cells) if name in (each.cell, plain[k])]
    if len(found) != 1:
        problem = "is there more than once" if found else f"is no column; {nearest(name, plain)}"
        problem += "; to the sheet of a frequency response, add --rig" if "frequency" in plain else ""
        raise InputError(f'{path}: "{name}" {problem}')
    return found[0]
