"""What a real bench leaves in its records, and how it is mended; every mend comes with the sentence that says so."""

from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.words import counted

MOST_BAD_TIMES = 0.01
GAP = 1.5  # of the period; a longer interval is a dropped sample
JITTER = 0.05  # of the period; less is the rounding of a printed time stamp


def good_times(path: Path, rows: np.ndarray, t: np.ndarray, cell: str) -> tuple[np.ndarray, list[str]]:
    """Rows to keep, [n] bool: those whose time stamp is later than all before. Raises InputError where many are not."""
    infinite = np.flatnonzero(np.isinf(t))
    if infinite.size:
        raise InputError(f'{path}: row {rows[infinite[0]]}, column "{cell}": infinite; mend the time stamp')
    latest = np.fmax.accumulate(np.concatenate(([-np.inf], t)))[:-1]
    bad = ~(t > latest)
    if not bad.any():
        return ~bad, []
    which = f'{bad.sum()} of {t.size} time stamps in column "{cell}" are missing, repeat or run backwards'
    if bad.mean() > MOST_BAD_TIMES:
        raise InputError(f"{path}: row {rows[np.argmax(bad)]}: {which}; export time with more digits or mend the clock")
    return ~bad, [f"{path.name}: {_rows(rows[: t.size][bad])} left out: {which}"]


def from_first(
    path: Path, rows: np.ndarray, keep: np.ndarray, command: np.ndarray, cell: str
) -> tuple[np.ndarray, list[str]]:
    """`keep` without the rows before the first known command: there is nothing to hold yet."""
    known = keep & ~np.isnan(command)
    if not known.any():
        return keep, []  # refused later, as an empty column
    early = keep & (np.arange(keep.size) < np.argmax(known))
    if not early.any():
        return keep, []
    return keep & ~early, [
        f'{path.name}: {_rows(rows[: keep.size][early])} left out: no command in column "{cell}" yet'
    ]


def uneven_times(path: Path, rows: np.ndarray, t: np.ndarray) -> list[str]:
    """Notes on dropped samples and on a clock that jitters; both are kept as recorded."""
    steps = np.diff(t)
    period = float(np.median(steps))
    gaps = steps > GAP * period
    notes = []
    if gaps.any():
        lost = int(np.sum(np.rint(steps[gaps] / period) - 1))
        samples = f"{counted(lost, 'sample')} dropped before {_rows(rows[1:][gaps])}"
        notes.append(f"{path.name}: {samples}; the command is held there")
    worst = float(np.max(np.abs(steps[~gaps] - period)))
    if worst > JITTER * period:
        notes.append(f"{path.name}: the clock jitters by up to {worst / period:.0%} of its period of {period:g} s")
    return notes


def missing_cells(path: Path, rows: np.ndarray, missing: np.ndarray, cell: str, done: str) -> list[str]:
    """The note on empty cells of a column."""
    if not missing.any():
        return []
    return [f'{path.name}: column "{cell}", {_rows(rows[missing])}: empty, {done}']


def forward_fill(values: np.ndarray) -> np.ndarray:
    """NaN replaced by the last value before it; the first value must be known."""
    known = np.where(np.isnan(values), 0, np.arange(values.size))
    return values[np.maximum.accumulate(known)]


def bridged(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """NaN replaced on the straight line between its neighbours, at an end by the nearest value."""
    known = ~np.isnan(values)
    return values if known.all() else np.interp(t, t[known], values[known])


def _rows(rows: np.ndarray) -> str:
    if rows.size == 1:
        return f"row {rows[0]}"
    shown = ", ".join(str(row) for row in rows[:5])
    return f"rows {shown}" + (f" and {rows.size - 5} more" if rows.size > 5 else "")
