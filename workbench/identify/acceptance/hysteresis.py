"""Hysteresis of a valve: how far the way up and the way down lie apart, less what its lag keeps them apart."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from ...records import Record
from .flow_curve import FlowCurve
from .opening import Opening
from .regression import Series, regress
from .row import Estimate, Row, measured, unsaid

_SMOOTH = 0.02  # s: over which a command's way is looked at
_MOVES = 0.02  # 1/s: a command that is slower than this, or than its noise, goes neither way
_SLOW = 2.0  # 1/s: faster ways are a matter of dynamics
GROUP = 0.5  # s
_FEWEST = 0.3  # s, each way

_MEANING = "hysteresis: commands of the same opening on the way up and down, over full command"


def hysteresis_row(records: Sequence[Record], opening: Opening | None, curve: FlowCurve | None) -> Row:
    """From the spool where it was recorded, else from a flow meter; null where neither says."""
    own = [(record, *_answer(record, opening, curve)) for record in records if _has_answer(record, opening, curve)]
    parts = [part for record, answer, follows in own if (part := _both_ways(record, answer, follows)) is not None]
    if not parts:
        what = "no record with a spool or a flow meter moves slowly up and down"
        return unsaid("hysteresis", _MEANING, "%", what)
    columns = parts[0].x.shape[1]
    fit = regress(parts, np.zeros(columns), np.full(columns, np.inf), summed=False)
    way = np.zeros(columns)
    way[-1] = -2.0
    estimate = Estimate(float(way @ fit.coefficients), fit.deviation(way), fit.freedom)
    return measured("hysteresis", _MEANING, "%", estimate, 100.0, positive=True)


def _has_answer(record: Record, opening: Opening | None, curve: FlowCurve | None) -> bool:
    spool = opening is not None and opening.travel is not None and "spool" in record.signals
    return spool or (curve is not None and "flow" in record.signals and "pa" not in record.signals)


def _answer(record: Record, opening: Opening | None, curve: FlowCurve | None) -> tuple[np.ndarray, np.ndarray]:
    """What the valve did [k] in units of the command, and the lagged command."""
    command = record.signals["command"]
    follows = command if opening is None else opening.follows(record)
    if opening is not None and opening.travel is not None and "spool" in record.signals:
        return (record.signals["spool"] - opening.bias) / opening.travel, follows
    assert curve is not None
    return np.interp(record.signals["flow"], curve.flow, curve.command), follows


def _both_ways(record: Record, answer: np.ndarray, follows: np.ndarray) -> Series | None:
    """The slow ways of a record: the answer over a line, a lag that is left, and the way that the command goes."""
    rows = max(1, round(_SMOOTH / record.period))
    rate = np.gradient(uniform_filter1d(follows, rows, mode="nearest"), record.period)
    moves = (np.abs(rate) > _MOVES) & (np.abs(rate) < _SLOW)
    least = _FEWEST / record.period
    if min((moves & (rate > 0)).sum(), (moves & (rate < 0)).sum()) < least:
        return None
    x = np.column_stack((np.ones_like(rate), follows, rate, np.sign(rate)))[moves]
    return Series(answer[moves], x, max(1, round(GROUP / record.period)))
