"""The figures of a flow curve that a valve's sheet has, in the manner of ISO 10770-1: what each means is in its line.

Gains are slopes of straight lines through each side of the curve from 5 % of full command on; the lap is the distance
between the commands at which both lines come to zero flow, positive for an overlap.
"""

from collections.abc import Callable

import numpy as np

from .flow_curve import FlowCurve
from .row import CONFIDENCE, Row, measured, unsaid

STRAIGHT = 0.05  # of full command, from which on a side is taken as straight
NULL = 0.002  # of full command: half the span over which the gain at null is taken
FULL = 0.98  # of full command, which counts as all of it
_PER_MINUTE = 60000.0  # l/min of a m^3/s
_STEP = 1e-6
_FEWEST = 3  # nodes of a side


def curve_rows(curve: FlowCurve) -> list[Row]:
    """Flow, gains, linearity, symmetry, lap and null bias. The flow is null where the records do not open the valve."""
    how = f"from {curve.source}"
    return [
        _rated(curve, how),
        *(_gain(curve, f"flow_gain_{name}", side, how) for name, side in (("extending", 1.0), ("retracting", -1.0))),
        _line(
            curve, "flow_gain_null", "flow gain about null, per full command", "l/min", _PER_MINUTE, _null_gain, _near
        ),
        _line(
            curve, "symmetry", "gain of one direction less the other's, over the larger", "%", 100.0, _symmetry, _sides
        ),
        _linearity(curve),
        _line(
            curve, "lap", "lap: between the commands where both straight sides come to zero", "%", 100.0, _lap, _sides
        ),
        _line(curve, "null_bias", "command at which no flow passes", "%", 100.0, null_bias, _near),
    ]


def null_bias(command: np.ndarray, flow: np.ndarray) -> float:
    """The command at which the curve passes zero, nearest to command 0."""
    crossings = np.flatnonzero(np.diff(np.sign(flow)) != 0)
    if not crossings.size:
        return float("nan")
    at = command[crossings] - flow[crossings] * np.diff(command)[crossings] / np.diff(flow)[crossings]
    return float(at[np.argmin(np.abs(at))])


def _rated(curve: FlowCurve, how: str) -> Row:
    id, meaning = "main_flow", f"flow of one valve at full command and 70 bar valve drop, {how}"
    reached = min(float(curve.command[-1]), float(-curve.command[0]))
    if reached < FULL:
        return unsaid(id, meaning, "l/min", f"the records open the valve to {100 * reached:.3g} % of full command only")
    ends = np.zeros(curve.command.size)
    ends[0], ends[-1] = -0.5 / -curve.command[0], 0.5 / curve.command[-1]
    return measured(id, meaning, "l/min", curve.estimate(ends), _PER_MINUTE)


def _gain(curve: FlowCurve, id: str, side: float, how: str) -> Row:
    meaning = f"flow gain {id.rpartition('_')[2]} from {100 * STRAIGHT:g} % on, per full command, {how}"
    return _line(curve, id, meaning, "l/min", _PER_MINUTE, lambda u, q: _side(u, q, side)[0], _sides)


def _line(
    curve: FlowCurve,
    id: str,
    meaning: str,
    unit: str,
    scale: float,
    figure: Callable[[np.ndarray, np.ndarray], float],
    lacks: Callable[[np.ndarray], str],
) -> Row:
    """A figure of the curve, its deviation by the slopes over the curve's nodes."""
    if reason := lacks(curve.command):
        return unsaid(id, meaning, unit, reason)
    value = figure(curve.command, curve.flow)
    if not np.isfinite(value):
        return unsaid(id, meaning, unit, "the curve does not pass zero flow")
    step = _STEP * float(np.abs(curve.flow).max())
    moved = [figure(curve.command, curve.flow + step * each) for each in np.eye(curve.flow.size)]
    return measured(id, meaning, unit, curve.estimate((np.array(moved) - value) / step, value), scale)


def _near(command: np.ndarray) -> str:
    inside = np.abs(command) <= 5 * NULL
    return "" if inside.sum() >= 3 else "the records do not stay about null"


def _sides(command: np.ndarray) -> str:
    if all((side * command >= STRAIGHT).sum() >= _FEWEST for side in (1.0, -1.0)):
        return ""
    return f"the records do not open the valve far enough beyond {100 * STRAIGHT:g} % both ways"


def _side(command: np.ndarray, flow: np.ndarray, side: float) -> tuple[float, float]:
    """Slope and intercept of the straight line through a side."""
    on = side * command >= STRAIGHT
    slope, intercept = np.polyfit(command[on], flow[on], 1)
    return float(slope), float(intercept)


def _null_gain(command: np.ndarray, flow: np.ndarray) -> float:
    high, low = (float(np.interp(end, command, flow)) for end in (NULL, -NULL))
    return (high - low) / (2 * NULL)


def _symmetry(command: np.ndarray, flow: np.ndarray) -> float:
    ahead, back = (_side(command, flow, side)[0] for side in (1.0, -1.0))
    return (ahead - back) / max(ahead, back)


def _lap(command: np.ndarray, flow: np.ndarray) -> float:
    (ahead, over), (back, under) = (_side(command, flow, side) for side in (1.0, -1.0))
    return -over / ahead + under / back


def _linearity(curve: FlowCurve) -> Row:
    """The node that is furthest off its side's line: its distance, over the flow at the side's end.

    Of many nodes the furthest is far by noise too, so that the interval is that of all of them together (Bonferroni).
    """
    id, meaning = "linearity", "furthest from the straight line of its side, over the flow at its end"
    if reason := _sides(curve.command):
        return unsaid(id, meaning, "%", reason)
    every = [curve.estimate(each) for side in (1.0, -1.0) for each in _distances(curve, side)]
    ends = [each.interval(1 - (1 - CONFIDENCE) / len(every)) for each in every]
    low = max(max(under, -over, 0.0) for under, over in ends)
    value, high = max(abs(each.value) for each in every), max(max(abs(under), abs(over)) for under, over in ends)
    return Row(id, meaning, "%", 100 * value, 100 * low, 100 * high)


def _distances(curve: FlowCurve, side: float) -> list[np.ndarray]:
    on = side * curve.command >= STRAIGHT
    columns = np.column_stack((curve.command[on], np.ones(int(on.sum()))))
    left = np.eye(int(on.sum())) - columns @ np.linalg.pinv(columns)
    spread = np.zeros((int(on.sum()), curve.command.size))
    spread[:, on] = left / float(np.abs(curve.flow[on]).max())
    return list(spread)
