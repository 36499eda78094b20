"""Records from files: columns found and converted, blemishes mended and noted, or refused by file, column and row."""

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.signals import DRIVING, FURTHER_INPUTS, SIGNALS
from . import repair as mend
from .columns import HELD, Column, ColumnMap, choose
from .record import Record
from .table import FORMATS, open_table

FEWEST_ROWS = 10
INPUTS = (*DRIVING, *FURTHER_INPUTS)  # held, never bridged
_SQUARED = 1e-100, 1e100  # SI: the square of what is smaller or larger is no number to compute with
UNUSED = "not used: "
"""Begins what a note says of columns that are no signals."""
MOST_MISSING = 0.20  # of a column; more is a dead sensor, not a blemish


def read_record(
    path: str | Path,
    mapping: Mapping[str, ColumnMap] | None = None,
    start: float | None = None,
    stop: float | None = None,
    unused: Collection[str] = (),
) -> Record:
    """Read a record.

    Mended and noted: NaN in a measured cell (filled, valid False), NaN in the command (held), a few bad time stamps
    (row left out). Noted only: dropped samples, jitter, columns not used.

    Parameters
    ----------
    path
        The file.
    mapping
        Column by signal, where names or units differ.
    start
        First time [s] of a slice.
    stop
        Time [s] before which the slice ends.
    unused
        Signals to leave out.

    Returns
    -------
    The record, SI.

    Raises
    ------
    InputError
        For everything else that is wrong with the file.
    """
    path = Path(path)
    table = open_table(path)
    columns, ignored = choose(path, table.header, mapping or {}, unused)
    _refuse_few(path, table.rows.size)
    raw = table.read(list(dict.fromkeys(column.cell for column in columns.values())))
    time, command = columns.pop("t", None), next(columns[name] for name in DRIVING if name in columns)
    rows = table.rows[: raw[command.cell].size]
    t = _clock(mapping or {}, rows.size) if time is None else time.to_si(raw[time.cell], "s")
    t, keep, notes = mend.good_times(path, rows, t, "t" if time is None else time.cell)
    keep, more = mend.from_first(path, rows, keep, raw[command.cell], command.cell)
    values = {column.cell: raw[column.cell] for column in columns.values()}
    keep, less = mend.shared(path, t, keep, values, FEWEST_ROWS)
    t, rows, notes = t[keep], rows[keep], notes + more + less
    _refuse_few(path, t.size)
    notes += mend.uneven_times(path, rows, t)
    signals, valid = {}, {}
    for name, column in columns.items():
        values = raw[column.cell][keep]
        _refuse(path, rows, column, values)
        filled, known, more = _mended(path, rows, t, name, column, values)
        signals[name] = column.to_si(filled, SIGNALS[name].si)
        _refuse_absurd(path, column.cell, signals[name], SIGNALS[name].si)
        valid[name] = known & _inside(column.clip, filled)
        if known.any() and not valid[name].any():
            raise InputError(f"{path}: {column.cell}: clip leaves no sample, they go {_range(filled)}; widen it")
        notes += [*more, *mend.below_vacuum(path, name, column.cell, signals[name])]
    if ignored:
        notes.append(f"{path.name}: {UNUSED}" + ", ".join(ignored))
    record = Record(record_name(path), t, signals, valid, tuple(notes))
    return record if start is None and stop is None else _cut(path, record, start, stop)


def record_name(path: Path) -> str:
    """The file's name without its suffix."""
    for suffix in sorted(FORMATS, key=len, reverse=True):
        if path.name.lower().endswith(suffix):
            return path.name[: -len(suffix)]
    return path.name


def _mended(
    path: Path, rows: np.ndarray, t: np.ndarray, name: str, column: Column, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """The values without NaN, where they were known, and the note on it."""
    known = ~np.isnan(values)
    if column.between is not None:
        first = np.arange(values.size) >= np.argmax(known)
        filled = mend.forward_fill(values) if column.between == HELD else mend.bridged(t, values)
        return np.where(first, filled, values[known][0]), first, []
    if name in INPUTS:
        return mend.forward_fill(values), known, mend.missing_cells(path, rows, ~known, column.cell, "held")
    return mend.bridged(t, values), known, mend.missing_cells(path, rows, ~known, column.cell, "not compared")


def _clock(mapping: Mapping[str, ColumnMap], rows: int) -> np.ndarray:
    """Times [rows] s of a file without a clock, from 0."""
    period = mapping["t"].period
    assert period is not None
    return period * np.arange(rows)


def _inside(clip: tuple[float, float] | None, values: np.ndarray) -> np.ndarray:
    return np.ones(values.size, dtype=bool) if clip is None else (values > clip[0]) & (values < clip[1])


def _range(values: np.ndarray) -> str:
    return f"from {values.min():.6g} to {values.max():.6g}"


def _refuse_few(path: Path, rows: int) -> None:
    if rows == 0:
        raise InputError(f"{path}: a header but no rows; record or export it again")
    if rows < FEWEST_ROWS:
        raise InputError(f"{path}: only {rows} rows; a record needs at least {FEWEST_ROWS}")


def _refuse(path: Path, rows: np.ndarray, column: Column, values: np.ndarray) -> None:
    cell = column.cell
    infinite = np.flatnonzero(np.isinf(values))
    if infinite.size:
        raise InputError(f'{path}: row {rows[infinite[0]]}, column "{cell}": infinite; mend it or leave it empty')
    missing = np.isnan(values)
    if missing.all():
        raise InputError(f'{path}: column "{cell}": every cell is empty; remove the column')
    if missing.mean() > MOST_MISSING and column.between is None:
        where = f'{path}: column "{cell}": {missing.sum()} of {missing.size} cells are empty'
        raise InputError(f"{where}, the first in row {rows[np.argmax(missing)]}; mend it or remove the column")


def _refuse_absurd(path: Path, cell: str, values: np.ndarray, unit: str) -> None:
    largest = float(np.max(np.abs(values)))
    if largest and not _SQUARED[0] < largest < _SQUARED[1]:
        raise InputError(f'{path}: column "{cell}": {largest:.2g} {unit} at most, which no rig has; check its unit')


def _cut(path: Path, record: Record, start: float | None, stop: float | None) -> Record:
    part = record.slice(start, stop)
    if part.t.size < FEWEST_ROWS:
        asked = f"from {record.t[0] if start is None else start:g} to {record.t[-1] if stop is None else stop:g} s"
        span = f"the record runs from {record.t[0]:g} to {record.t[-1]:g} s"
        raise InputError(f"{path}: {part.t.size} rows {asked}, at least {FEWEST_ROWS} are needed; {span}")
    return part
