"""Hysteresis of a valve, how far the way up and the way down lie apart, less what its lag keeps them apart; and its
threshold, the same of small commands about null."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from ...records import Record
from .flow_curve import FlowCurve
from .opening import Opening
from .regression import Series, regress
from .row import Estimate, Row, measured, unsaid

_SMOOTH = 0.02  # s: over which a command's way is looked at
_TURNED = 0.02, 1 / 6  # of full command, of a record's span: how far behind a turn, where the valve may still stand
_LAG_KNOWN = 0.3  # of a lag: its deviation, that of a valve's model or of what a fit leaves
_ANSWERS = 0.5  # of a command: a valve that follows less of it has not moved
_SMALL = 0.1  # of full command, from the least to the greatest: a record about null
GROUP = 0.5  # s
_FEWEST = 0.3  # s, each way


@dataclass(frozen=True)
class _Line:
    """A line of the sheet: the ways that it looks at, between two rates [1/s]."""

    id: str
    meaning: str
    slow: tuple[float, float]
    none: str


_HYSTERESIS = _Line(
    "hysteresis",
    "hysteresis: commands of the same opening on the way up and down, over full command",
    (0.02, 2.0),  # slower goes neither way, or is the threshold's; faster is a matter of dynamics
    "no record with a spool or a flow meter moves slowly up and down",
)
_THRESHOLD = _Line(
    "threshold",
    "threshold: how far a small command goes back about null until the valve answers, over full command",
    (0.002, 0.02),
    f"no record with a spool or a flow meter moves slowly both ways within {100 * _SMALL:g} % of command",
)


def hysteresis_row(
    records: Sequence[Record], opening: Opening | None, curve: FlowCurve | None, lagging: Opening
) -> Row:
    """From the spool where it was recorded, else from a flow meter; null where neither says. `lagging` has the lag."""
    return _row(_HYSTERESIS, records, opening, curve, lagging)


def threshold_row(records: Sequence[Record], opening: Opening | None, curve: FlowCurve | None, lagging: Opening) -> Row:
    """The row of the threshold, from records of small commands, both ways of a triangle about null."""
    small = [record for record in records if np.ptp(record.signals["command"]) <= _SMALL]
    return _row(_THRESHOLD, small, opening, curve, lagging)


def _row(
    line: _Line, records: Sequence[Record], opening: Opening | None, curve: FlowCurve | None, lagging: Opening
) -> Row:
    own = [record for record in records if _has_answer(record, opening, curve)]
    found = (_both_ways(each, _answer(each, opening, curve), lagging.follows(each), line.slow) for each in own)
    parts = [part for part in found if part is not None]
    if not parts:
        return unsaid(line.id, line.meaning, "%", line.none)
    late = _LAG_KNOWN * 2 * lagging.lag.damping / (2 * np.pi * lagging.lag.frequency)
    fit = regress(parts, np.zeros(4), np.array([np.inf, np.inf, late, np.inf]), summed=False)
    if fit.coefficients[1] < _ANSWERS:
        return unsaid(line.id, line.meaning, "%", "the valve does not answer to commands so small")
    way = np.array([0.0, 0.0, 0.0, -2.0])
    estimate = Estimate(float(way @ fit.coefficients), fit.deviation(way), fit.freedom)
    return measured(line.id, line.meaning, "%", estimate, 100.0, positive=True)


def _has_answer(record: Record, opening: Opening | None, curve: FlowCurve | None) -> bool:
    spool = opening is not None and opening.travel is not None and "spool" in record.signals
    return spool or (curve is not None and "flow" in record.signals and "pa" not in record.signals)


def _answer(record: Record, opening: Opening | None, curve: FlowCurve | None) -> np.ndarray:
    """What the valve did [k] in units of the command."""
    if opening is not None and opening.travel is not None and "spool" in record.signals:
        return (record.signals["spool"] - opening.bias) / opening.travel
    assert curve is not None
    return np.interp(record.signals["flow"], curve.flow, curve.command)


def _both_ways(record: Record, answer: np.ndarray, follows: np.ndarray, slow: tuple[float, float]) -> Series | None:
    """The slow ways of a record, clear of its turns: the answer over a line, what is left of the lag, and the way that
    the command goes."""
    rows = max(1, round(_SMOOTH / record.period))
    rate = np.gradient(uniform_filter1d(follows, rows, mode="nearest"), record.period)
    size, clear = np.abs(rate), min(_TURNED[0], _TURNED[1] * float(np.ptp(follows)))
    moves = (size > slow[0]) & (size < slow[1]) & (_since_turn(follows, rate) > clear)
    if min((moves & (rate > 0)).sum(), (moves & (rate < 0)).sum()) < _FEWEST / record.period:
        return None
    x = np.column_stack((np.ones_like(rate), follows, rate, np.sign(rate)))[moves]
    return Series(answer[moves], x, max(1, round(GROUP / record.period)))


def _since_turn(follows: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """How far [k] a command has gone since it last turned, or since the record began."""
    turns = np.flatnonzero(np.diff(np.sign(rate), prepend=0.0))
    last = np.zeros(follows.size, dtype=int)
    last[turns] = turns
    return np.abs(follows - follows[np.maximum.accumulate(last)])
