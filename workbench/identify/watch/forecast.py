"""When a loop's figure will pass a limit, if what changes goes on as it does."""

from collections.abc import Mapping, Sequence
from datetime import date, timedelta
from typing import Any

import numpy as np

from ...base.words import counted
from ...rigs.rig import Rig
from .history import History
from .loop_costs import TunedLoop, margins, rig_with
from .told import NamedChange

LIMITS = {"gain_margin_db": (6.0, -1), "phase_margin_deg": (30.0, -1), "ms": (2.5, 1)}  # and on which side it is worse
LOST = 1.0  # dB of the first session's gain margin
NORMAL_80 = 1.2816  # standard deviations in half of an 80 % interval
_HORIZON = 1.0  # years ahead; beyond it nothing is said
_PLACES = 9  # of the course ahead, at which the loop is judged
_FEWEST = 4


def unforeseen(told: NamedChange | None) -> str:
    """Why nothing is foreseen of a change, in a sentence; empty where its course is known."""
    if told is None:
        return "No alarm stands, so that nothing is foreseen."
    if told.name.axis is None:
        return "What changed has no name, so that neither the loop is known since then nor what comes of it."
    if told.change.shape != "drift":
        return "What changed did so at once and goes no further, so that nothing is foreseen."
    if len(told.numbers) < _FEWEST:
        seen = counted(len(told.numbers), "session")
        return f"What drifts could be fitted in {seen}; to foresee how it goes on takes {_FEWEST}."
    return ""


def forecasts(
    known: History,
    told: NamedChange | None,
    costs: Mapping[str, Sequence[float | None]],
    usual: Mapping[str, float],
    first: date,
    loop: TunedLoop,
    rig: Rig,
) -> tuple[list[dict[str, Any]], str]:
    """The days between which each figure that drifts towards its limit passes it, with 80 %; and of the others
    a sentence, why they have none.

    What is named goes on by its rate, the other numbers are their `usual` ones: the newest session's oil is not that of
    the day. The loop is judged on the rig of some days ahead, and a limit lies between two of them. The rate is as
    uncertain as it has been unsteady, and the figure as it has wandered before the change.
    """
    why = unforeseen(told)
    if told is None or why:
        return [], why
    now = float(known.days[-1])
    ahead = now + np.linspace(0.0, 1.0, _PLACES) ** 2 * _HORIZON * 365.25
    others = {name: value for name, value in usual.items() if name not in told.moving}
    seen = [margins(loop, rig_with(rig, told.numbers_at(day, known.days) | others)) for day in ahead]
    limits = [(name, limit, side) for name, (limit, side) in LIMITS.items() if any(costs[name])]  # it has such margins
    start = next((value for value in costs["gain_margin_db"] if value is not None), None)
    if start is not None:
        limits.append(("gain_margin_db", start - LOST, -1))
    rows, past = [], []
    for name, limit, side in limits:
        values = [each.get(name) for each in seen]
        if _beyond(values[0], limit, side) >= 0:
            past.append(f"{name.removesuffix('_db').removesuffix('_deg').replace('_', ' ')} {limit:.3g}")
        day = passes(ahead - now, values, limit, side)
        wander = 0.0 if day is None else _wander(costs[name][: told.change.first], ahead - now, values, day)
        between = None if day is None else interval(day, told.unsteady(day), wander)
        if between:
            days = [str(first + timedelta(days=round(now + day))) for day in between]
            rows.append(
                {"figure": name, "limit": round(limit, 3), "from": days[0], "to": days[1], "by": told.name.axis}
            )
    said = f"Beyond already: {', '.join(past)}." if past else ""
    within = f"Within {_HORIZON:g} year {'no other' if past else 'no'} figure of the loop passes a limit."
    return rows, said if rows else f"{said} {within}".lstrip()


def _beyond(value: float | None, limit: float, side: int) -> float:
    """How far a figure is beyond its limit, below 0 where it is not; a loop that has none is beyond."""
    return np.inf if value is None else side * (value - limit)


def passes(ahead: np.ndarray, values: Sequence[float | None], limit: float, side: int) -> float | None:
    """The day on which a figure passes the limit, of its values so many days ahead [n].
    None where it has passed, or does not."""
    y = np.array([_beyond(value, limit, side) for value in values])
    beyond = np.flatnonzero(y >= 0)
    if not beyond.size or beyond[0] == 0:
        return None
    k = int(beyond[0])
    share = -y[k - 1] / (y[k] - y[k - 1]) if np.isfinite(y[k]) else 0.5
    return float(ahead[k - 1] + share * (ahead[k] - ahead[k - 1]))


def interval(day: float, unsteady: float, wander: float = 0.0) -> tuple[float, float]:
    """With 80 %, where the rate has a relative standard deviation, and the day one of its own [days]."""
    ends = (day * float(np.exp(side * NORMAL_80 * unsteady)) - day for side in (-1, 1))
    before, after = (float(np.hypot(end, NORMAL_80 * wander)) for end in ends)
    return max(day - before, 0.0), day + after


def _wander(healthy: Sequence[float | None], ahead: np.ndarray, values: Sequence[float | None], day: float) -> float:
    """The standard deviation [days] of the day on which a figure passes, of what it has wandered in `healthy` sessions
    and of how steeply it falls then."""
    seen = [value for value in healthy if value is not None]
    k = int(np.clip(np.searchsorted(ahead, day), 1, len(ahead) - 1))
    before, after = values[k - 1], values[k]
    if len(seen) < _FEWEST or before is None or after is None or before == after:
        return 0.0
    return float(np.std(seen, ddof=1) * (ahead[k] - ahead[k - 1]) / abs(after - before))
