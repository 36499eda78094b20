"""Pressure gain and internal leakage of a valve whose load ports are blocked."""

from collections.abc import Sequence

import numpy as np

from ...records import Record
from .regression import Series, regress
from .row import Estimate, Row, measured, unsaid

LINEAR = 0.4  # of the largest load pressure, up to which the gain is a straight line's slope
_BIN = 1e-3  # of full command: over which leakage is averaged
_GROUP = 0.1  # s
_PER_MINUTE = 60000.0  # l/min of a m^3/s
_GAIN = ("pressure_gain", "load pressure per 1 % of full command, ports blocked", "bar")
_LEAK = ("leakage", "largest internal leakage of the main lands about null, ports blocked", "l/min")


def pressure_rows(records: Sequence[Record]) -> list[Row]:
    """Of records valve-pressure, with `pa` and `pb`, and `flow` what the supply gives."""
    gain, leak = (next((r for r in records if set(names) <= set(r.names)), None) for names in (("pa", "pb"), ("flow",)))
    lacks = "no record valve-pressure, with blocked load ports"
    return [
        unsaid(*_GAIN, f"{lacks}, pa and pb") if gain is None else _gain(gain),
        unsaid(*_LEAK, f"{lacks} and the flow of the supply") if leak is None else _leak(leak),
    ]


def _gain(record: Record) -> Row:
    load, command = record.signals["pa"] - record.signals["pb"], record.signals["command"]
    straight = np.abs(load - (load.max() + load.min()) / 2) < LINEAR * np.ptp(load) / 2
    # the command on the load, not the load on the command: noise of the load would choose which rows count as straight
    x = np.column_stack((command[straight], np.ones(int(straight.sum()))))
    group = max(1, round(_GROUP / record.period))
    if np.unique(command[straight]).size < 3:
        return unsaid(*_GAIN, "the command passes null too fast for the load pressure to be seen rise")
    fit = regress([Series(load[straight], x, group)], np.zeros(2), np.full(2, np.inf), summed=False)
    slope = np.array([1.0, 0.0])
    return measured(*_GAIN, Estimate(float(fit.coefficients[0]), fit.deviation(slope), fit.freedom), 1e-7)


def _leak(record: Record) -> Row:
    """The bin of commands in which most flows, averaged."""
    cells = np.round(record.signals["command"] / _BIN).astype(int)
    flow = record.signals["flow"]
    means = {cell: flow[cells == cell] for cell in np.unique(cells) if (cells == cell).sum() >= 5}
    most = max(means.values(), key=lambda values: float(values.mean()))
    estimate = Estimate(float(most.mean()), float(most.std(ddof=1) / np.sqrt(most.size)), most.size - 1.0)
    return measured(*_LEAK, estimate, _PER_MINUTE)
