"""What a real bench leaves in its records, and how it is mended; every mend comes with the sentence that says so."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.words import counted

MOST_BAD_TIMES = 0.01
GAP = 1.5  # of the period; a longer interval is a dropped sample
JITTER = 0.05  # of the period; less is the rounding of a printed time stamp
_HOUR = 3600.0  # s
_ROUNDED = 0.6  # of the step between stamps that repeat: how far they may lie from even times that were rounded
_NEARLY_ALL = 0.98
_ABSOLUTE = ("pa", "pb", "line_pa", "line_pb", "supply")  # pressures
_NOISY = 0.2  # bar: how far a transducer may read below 0
_OFF_BEAT, _MOST_OFF = 0.25, 0.1  # periods by which an interval is no multiple of one; share of them of an even clock


def good_times(path: Path, rows: np.ndarray, t: np.ndarray, cell: str) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Times [n] s, mended, and the rows to keep, [n] bool: those whose time stamp is later than all before.

    Raises InputError where many are not, and where the rows come at no even pace.
    """
    infinite = np.flatnonzero(np.isinf(t))
    if infinite.size:
        raise InputError(f'{path}: row {rows[infinite[0]]}, column "{cell}": infinite; mend the time stamp')
    t, said = continuous(t)
    notes = [f'{path.name}: column "{cell}": {each}' for each in said]
    latest = np.fmax.accumulate(np.concatenate(([-np.inf], t)))[:-1]
    bad = ~(t > latest)
    if bad.any():
        which = f'{bad.sum()} of {t.size} time stamps in column "{cell}" are missing, repeat or run backwards'
        if bad.mean() > MOST_BAD_TIMES:
            mend = "export time with more digits or mend the clock"
            raise InputError(f"{path}: row {rows[np.argmax(bad)]}: {which}; {mend}")
        notes.append(f"{path.name}: {_rows(rows[: t.size][bad])} left out: {which}")
    return t, ~bad, notes


def continuous(t: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Times [n] s without the hour by which clocks are changed, and even where stamps were rounded until they repeat;
    what was done. Other times stay as they are."""
    t, notes = _without_changes(t)
    steps = np.diff(t)
    if t.size < 2 or not np.mean(steps == 0.0) > MOST_BAD_TIMES or np.any(~(steps >= 0.0)):
        return t, notes
    rounded, number = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0, np.arange(t.size)
    period = _short(float(np.polyfit(number, t - t[0], 1)[0]), 0.1 * rounded / t.size)
    first = float(np.mean(t - period * number))
    even = (t[0] if t[0] == 0.0 or abs(first - t[0]) < period / 2 else first) + period * number
    if rounded == 0.0 or np.max(np.abs(first + period * number - t)) > _ROUNDED * rounded:
        return t, notes
    said = f"stamps repeat, rounded to {rounded:.6g} s: taken as even: they agree with a row every {period:.6g} s"
    return even, [*notes, said]


def _without_changes(t: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Times [n] s that go on where a clock was set back or forth by an hour."""
    steps = np.diff(t)
    if not np.any(np.abs(steps) > _HOUR / 2):
        return t, []
    period = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    jumps = _HOUR * np.round(steps / _HOUR)
    changed = (np.abs(jumps) == _HOUR) & (steps - jumps >= -1e-6) & (steps - jumps <= 2 * period)
    words = {-_HOUR: "back", _HOUR: "on"}
    notes = [
        f"the clock goes {words[float(jumps[place])]} by an hour, a change of the clocks, at {t[place]:.6g} s; "
        "the rows are taken as one recording: where it did stop for that hour, cut the file there into two"
        for place in np.flatnonzero(changed)[:3].tolist()
    ]
    return t - np.concatenate(([0.0], np.cumsum(np.where(changed, jumps, 0.0)))), notes


def _short(value: float, slack: float) -> float:
    """The number of fewest digits within `slack` of a value."""
    return next((n for digits in range(1, 12) if abs((n := float(f"{value:.{digits}g}")) - value) <= slack), value)


def shared(
    path: Path, t: np.ndarray, keep: np.ndarray, columns: Mapping[str, np.ndarray], fewest: int
) -> tuple[np.ndarray, list[str]]:
    """`keep` without the rows at the ends in which a column has no value yet, or none any more, where it has them in
    most rows; and the notes on them."""
    notes = []
    for cell, values in columns.items():
        known = np.flatnonzero(~np.isnan(values) & keep)
        if known.size == 0 or known[-1] - known[0] + 1 < max(fewest, keep.size / 2):
            continue  # refused later, as an empty column
        inside = keep & (np.arange(keep.size) >= known[0]) & (np.arange(keep.size) <= known[-1])
        if np.any(keep & ~inside):
            said = f'left out: column "{cell}" has values from {t[known[0]]:.6g} to {t[known[-1]]:.6g} s alone'
            notes.append(f"{path.name}: {counted(int(np.sum(keep & ~inside)), 'row')} {said}")
            keep = inside
    return keep, notes


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


def below_vacuum(path: Path, name: str, cell: str, values: np.ndarray) -> list[str]:
    """The note on an absolute pressure [Pa] below any: gauge pressure, down to 1 atm below 0, or a wrong zero."""
    low = float(np.min(values)) / 1e5
    if name not in _ABSOLUTE or low > -_NOISY:
        return []
    cure = "if it is gauge pressure, add its 1.013 bar" if low > -1.013 - _NOISY else "put its zero right"
    return [
        f'{path.name}: column "{cell}" goes down to {low:.3g} bar, and pressures are absolute; {cure} by an offset '
        f"under [signals.{name}]"
    ]


def uneven_times(path: Path, rows: np.ndarray, t: np.ndarray) -> list[str]:
    """Notes on dropped samples, on a clock that jitters and on one without a period; all are kept as recorded."""
    steps, longest = np.diff(t), longest_interval(t)
    period = float(np.median(steps))
    gaps = steps > longest
    notes = []
    if gaps.any():
        lost = int(np.sum(np.rint(steps[gaps] / period) - 1))
        samples = f"{counted(lost, 'sample')} dropped before {_rows(rows[1:][gaps])}"
        notes.append(f"{path.name}: {samples}; the command is held there")
    if longest > GAP * period:
        low, high = 1e3 * np.quantile(steps, (0.02, 0.98))
        return [*notes, f"{path.name}: the clock has no period; rows come {low:.3g} to {high:.3g} ms apart"]
    worst = float(np.max(np.abs(steps[~gaps] - period)))
    if worst > JITTER * period:
        notes.append(f"{path.name}: the clock jitters by up to {worst / period:.0%} of its period of {period:g} s")
    return notes


def longest_interval(t: np.ndarray) -> float:
    """The longest interval [s] of a clock t [n] in which no sample was dropped: 1.5 periods; of a clock without a
    period, whose intervals are no multiples of one, 1.5 times what nearly all of them are."""
    steps = np.diff(t)
    period = float(np.median(steps))
    uneven = np.mean(np.abs(steps / period - np.fmax(1.0, np.rint(steps / period))) > _OFF_BEAT) > _MOST_OFF
    return GAP * (max(period, float(np.quantile(steps, _NEARLY_ALL))) if uneven else period)


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
