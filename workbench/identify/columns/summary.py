"""What a column's numbers say: range, what is missing, whether it is a clock."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...records.repair import continuous

SKETCH = 240  # values of a small picture


@dataclass(frozen=True)
class ColumnSummary:
    """A column over all the records that have it, in its own unit.

    usual_low    below it lies one value in a hundred of the record that goes lowest
    travel   its widest range within a record; NaN without a number
    missing  share of cells without a number
    gaps     the same of those between the first and the last number of a record
    between  how it was filled between samples that are further apart than the rows; None where it was not
    step     median interval of a clock: of a column that increases from row to row, once mended; None of another
    sketch   [n] values of the first record, evenly taken, and `sketched`, the rows that they stand for
    """

    cell: str
    unit: str | None
    low: float
    high: float
    usual_low: float
    travel: float
    missing: float
    gaps: float
    between: str | None
    step: float | None
    records: tuple[str, ...]
    sketch: np.ndarray
    sketched: int

    @property
    def peak(self) -> float:
        """Largest magnitude."""
        return max(abs(self.low), abs(self.high))


def summary(
    cell: str, unit: str | None, records: Iterable[tuple[str, np.ndarray]], between: str | None = None
) -> ColumnSummary:
    """Facts of a column from its numbers [n] in each record that has it, taken one after the other."""
    names, extents, steps, empty, rows, inside = [], [], [], 0, 0, 0
    sketch, sketched = np.empty(0), 0
    for name, values in records:
        known = values[np.isfinite(values)]
        names.append(name)
        rows, empty = rows + values.size, empty + values.size - known.size
        places = np.flatnonzero(np.isfinite(values))
        inside += int(places[-1] - places[0] + 1 - places.size) if places.size else values.size
        steps.append(_step(known) if known.size == values.size else None)
        if known.size:
            extents.append((known.min(), known.max(), float(np.quantile(known, 0.01))))
        if not sketched:
            sketch, sketched = (
                values[np.linspace(0, values.size - 1, min(SKETCH, values.size)).astype(int)],
                values.size,
            )
    low = float(min((low for low, _, _ in extents), default=np.nan))
    high = float(max((high for _, high, _ in extents), default=np.nan))
    usual_low = float(min((usual for _, _, usual in extents), default=np.nan))
    travel = float(max((high - low for low, high, _ in extents), default=np.nan))
    missing, gaps = (empty / rows, inside / rows) if rows else (1.0, 1.0)
    return ColumnSummary(
        cell, unit, low, high, usual_low, travel, missing, gaps, between, _common(steps), tuple(names), sketch, sketched
    )


def _step(values: np.ndarray) -> float | None:
    """Median interval of numbers that increase as a clock does, but for one in a hundred; None of others."""
    values = continuous(values)[0]
    steps = np.diff(values)
    return float(np.median(steps)) if steps.size and np.mean(steps > 0) > 0.99 and np.median(steps) > 0 else None


def _common(steps: Sequence[float | None]) -> float | None:
    known = [step for step in steps if step is not None]
    return float(np.median(known)) if known and len(known) == len(steps) else None
