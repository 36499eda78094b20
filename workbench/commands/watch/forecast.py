"""When a loop's figure will pass a limit, if what changes goes on as it does."""

from collections.abc import Mapping, Sequence
from datetime import date, timedelta
from typing import Any

import numpy as np

from ...identify.watch.changes import History
from .told import NORMAL, Told

LIMITS = {"gain_margin_db": (6.0, -1), "phase_margin_deg": (30.0, -1), "ms": (2.5, 1)}  # and on which side it is worse
_DRAWS, _INTERVAL = 2000, (0.1, 0.9)
_HORIZON = 2.0  # years; beyond it nothing is said
_FEWEST = 4


def forecasts(
    known: History, told: Told | None, costs: Mapping[str, Sequence[float | None]], first: date
) -> list[dict[str, Any]]:
    """Of each figure that drifts towards its limit: the days between which it passes it, with 80 %.

    A straight line through the sessions since the change began; its slope is as uncertain as the scatter about the
    line, and as the change's own rate.
    """
    if told is None or told.change.shape != "drift" or not told.rate:
        return []
    value, low, high = told.rate
    of_rate = (high - low) / (2 * NORMAL * abs(value)) if value else 1.0
    rows = []
    for figure, (limit, side) in LIMITS.items():
        values = np.array([np.nan if each is None else each for each in costs[figure]])
        since = np.arange(len(values)) >= told.change.first - 1
        if np.count_nonzero(since & np.isfinite(values)) >= _FEWEST:
            between = _passes(known.days[since], values[since], limit, side, of_rate)
            if between:
                dates = [str(first + timedelta(days=round(day))) for day in between]
                rows.append({"figure": figure, "limit": limit, "from": dates[0], "to": dates[1], "by": told.name.axis})
    return rows


def _passes(
    days: np.ndarray, values: np.ndarray, limit: float, side: int, of_rate: float
) -> tuple[float, float] | None:
    """Days between which the line passes the limit with 80 %; None where it does not within the horizon, or has."""
    good = np.isfinite(values)
    t, y = days[good], values[good]
    centre = t.mean()
    slope = float((t - centre) @ (y - y.mean()) / ((t - centre) @ (t - centre)))
    left = y - y.mean() - slope * (t - centre)
    scatter = float(np.sqrt(left @ left / max(len(t) - 2, 1)))
    now = y.mean() + slope * (days[-1] - centre)
    if side * (now - limit) >= 0 or side * slope <= 0:
        return None
    random = np.random.default_rng(0)
    slopes = slope * (1 + of_rate * random.standard_normal(_DRAWS))
    slopes = slopes + scatter / np.sqrt((t - centre) @ (t - centre)) * random.standard_normal(_DRAWS)
    level = now + scatter / np.sqrt(len(t)) * random.standard_normal(_DRAWS)
    ahead = np.where(side * slopes > 0, (limit - level) / np.where(slopes == 0, np.nan, slopes), np.inf)
    low, high = np.quantile(np.maximum(ahead, 0.0), _INTERVAL)
    return None if low > _HORIZON * 365.25 else (days[-1] + low, days[-1] + min(high, 10 * 365.25))
