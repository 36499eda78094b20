"""sensor.shift: what a second logger recorded later, or earlier, than the command, and how sure that is.

A channel that is put back by T where it is late by T + d differs from its prediction y by -d y'; the least squares of
that over all train windows is what the fit leaves of d, and says how sure it is.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...base.words import listed
from ...rigs.driven import SHIFT
from ..fit.intervals import clustered, widest
from ..trace.findings import Trace
from ..trace.refit import run

_ROW = 0.01  # of a row: two loggers sample no closer than that at the instants that they say


@dataclass(frozen=True)
class LoggerShift:
    """Channels that are late together, by `late` [s], and its 95 % interval; the share that it explains."""

    channels: tuple[str, ...]
    late: float
    interval: tuple[float, float]
    explained: float

    @property
    def formula(self) -> str:
        """The channels in words."""
        return listed(self.channels)

    def json(self) -> dict[str, object]:
        """A row of the ranking of trace.json."""
        values = [1e3 * value for value in (self.late, *self.interval)]
        return {
            "effect": SHIFT,
            "formula": self.formula,
            "explained": self.explained,
            "parameters": {"late [ms]": values},
        }


def shifts(trace: Trace) -> list[LoggerShift]:
    """The channels that a trace put back, one entry for all that are late together; none where one logger recorded
    all."""
    late = trace.problem.late
    if not late:
        return []
    after, before = trace.heldout[0].chi2, chi2_as_recorded(trace)
    share = (before - after) / (before - 1)
    groups = {one: tuple(name for name in late if late[name] == one) for one in dict.fromkeys(late.values())}
    return [LoggerShift(names, *_as_fitted(trace, names, one), share) for one, names in groups.items()]


def chi2_as_recorded(trace: Trace) -> float:
    """chi2 of the held-out records as the two loggers wrote them, with the rig alone as it was fitted."""
    problem, model_fit = trace.problem, trace.base
    back = {name: -late for name, late in problem.late.items()}
    windows = problem.heldout
    written = replace(windows, records=tuple(record.earlier(back) for record in windows.records))
    written = written.some(range(windows.count))
    return float(run(problem, model_fit.model, written, model_fit.fit.p)[1].sum()) / written.samples


def _as_fitted(trace: Trace, names: tuple[str, ...], late: float) -> tuple[float, tuple[float, float]]:
    """How late channels are [s], and the 95 % interval: as of any fitted number, see fit/intervals.py."""
    problem, fit = trace.problem, trace.named.fit
    train, columns = problem.train, [problem.train.names.index(name) for name in names]
    slopes, square = np.zeros((train.count, 1)), np.zeros((1, 1))
    parts = trace.named.model.predict(train, fit.x0, fit.p)
    for group, predicted in zip(train.groups, parts, strict=True):
        y, weight = np.nan_to_num(predicted[..., columns]), group.weight[..., columns]
        rate = weight * np.gradient(y, axis=1) / train.records[0].period
        slopes[group.which, 0] = np.sum(rate * weight * (y - group.measured[..., columns]), axis=(1, 2))
        square += np.sum(rate * rate)
    noise = float(problem.kappas[columns].max()) * fit.louder * square
    scatters = [noise, *(clustered(slopes, train, by_record) for by_record in (False, True))]
    variance = float(widest(np.linalg.inv(square), scatters, np.zeros((1, 1)))[0, 0])
    deviation = float(np.hypot(np.sqrt(variance), _ROW * train.records[0].period))
    found = late + float(slopes.sum() / square[0, 0])
    return found, (found - 1.96 * deviation, found + 1.96 * deviation)
