"""Pressure gain and internal leakage of a valve whose load ports are blocked."""

from collections.abc import Sequence

import numpy as np

from ...records import Record
from .regression import Series, regress
from .row import Estimate, Row, measured, unsaid

LINEAR = 0.4  # of the largest load pressure, up to which the gain is a straight line's slope
_WIDE, _ORDER, _SOUGHT = 0.8, 4, 0.5  # of half the load pressure's range: rows of leakage; where its peak is sought
_BIN = 1e-3  # of full command: over which leakage is averaged without port pressures
_GROUP = 0.1  # s
_PER_MINUTE = 60000.0  # l/min of a m^3/s
_GAIN = ("pressure_gain", "load pressure per 1 % of full command, ports blocked", "bar")
_LEAK = ("leakage", "largest internal leakage of the main lands about null, ports blocked", "l/min")


def pressure_rows(records: Sequence[Record]) -> list[Row]:
    """The rows of records valve-pressure, with `pa` and `pb`, and `flow` what the supply gives."""
    gain, leak = (next((r for r in records if set(names) <= set(r.names)), None) for names in (("pa", "pb"), ("flow",)))
    lacks = "no record valve-pressure, with blocked load ports"
    return [
        unsaid(*_GAIN, f"{lacks}, pa and pb") if gain is None else _gain(gain),
        unsaid(*_LEAK, f"{lacks} and the flow of the supply") if leak is None else _leak(leak),
    ]


def _gain(record: Record) -> Row:
    command = record.signals["command"]
    way = np.sign(np.gradient(command))
    turned = np.flatnonzero(way != way[0])
    load, middle, half = _load(record)
    straight = np.abs(load - middle) < LINEAR * half
    straight[: turned[0] if turned.size else 0] = False  # from rest, the load is not yet as late as it will be
    # rows are chosen by the load, whose noise is small beside its range, and the command has none; its way takes up
    # that the load lags behind, which would flatten a line through both ways
    columns = np.column_stack((command, np.ones_like(command), way))[straight]
    group = max(1, round(_GROUP / record.period))
    if np.unique(command[straight]).size < 3:
        return unsaid(*_GAIN, "the command passes null too fast for the load pressure to be seen rise")
    fit = regress([Series(load[straight], columns, group)], np.zeros(3), np.full(3, np.inf), summed=False)
    gain, _, late = (float(number) for number in fit.coefficients)
    smoothed = abs(gain) * (late / half) ** 2  # a lag smooths the rise: by as much, in its square, as it shifts it
    deviation = float(np.hypot(fit.deviation(np.array([1.0, 0.0, 0.0])), smoothed))
    return measured(*_GAIN, Estimate(gain, deviation, fit.freedom), 1e-7)


def _leak(record: Record) -> Row:
    """By a polynomial over the load pressure where the ports were measured, else the mean over the bin of commands in
    which most flows."""
    estimate = _peak(record) if {"pa", "pb"} <= set(record.names) else _fullest(record)
    return measured(*_LEAK, estimate, _PER_MINUTE)


def _load(record: Record) -> tuple[np.ndarray, float, float]:
    """Load pressure [k] Pa, the middle of its range and half of that."""
    load = record.signals["pa"] - record.signals["pb"]
    return load, float(load.max() + load.min()) / 2, float(np.ptp(load)) / 2


def _peak(record: Record) -> Estimate:
    """The peak of flow over load pressure, which no lag shifts: it rises and falls about null, as a quartic does."""
    load, middle, half = _load(record)
    share, inside = (load - middle) / half, np.abs(load - middle) < _WIDE * half
    columns = np.vander(share[inside], _ORDER + 1, increasing=True)
    group = max(1, round(_GROUP / record.period))
    series = Series(record.signals["flow"][inside], columns, group)
    fit = regress([series], np.zeros(_ORDER + 1), np.full(_ORDER + 1, np.inf), summed=False)
    grid = np.vander(np.linspace(-_SOUGHT, _SOUGHT, 101), _ORDER + 1, increasing=True)
    most = grid[np.argmax(grid @ fit.coefficients)]
    return Estimate(float(most @ fit.coefficients), fit.deviation(most), fit.freedom)


def _fullest(record: Record) -> Estimate:
    cells = np.round(record.signals["command"] / _BIN).astype(int)
    flow = record.signals["flow"]
    means = {cell: flow[cells == cell] for cell in np.unique(cells) if (cells == cell).sum() >= 5}
    most = max(means.values(), key=lambda values: float(values.mean()))
    return Estimate(float(most.mean()), float(most.std(ddof=1) / np.sqrt(most.size)), most.size - 1.0)
