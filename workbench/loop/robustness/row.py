"""One row of a controller over all drawn plants."""

from typing import Any

import numpy as np

from ...base.numbers import finite, quantile
from ...plant import build
from ..limit import times_limit
from .kept import Kept
from .linear_loops import Place
from .plant_draw import drawn
from .problem import RobustnessProblem

_WEIGHTS = {"unstable": 4, "tripped": 2, "hunting": 1}  # how bad, for the worst plant


def kept_row(kept: Kept, problem: RobustnessProblem, limit: float | None) -> dict[str, Any]:
    """One row: quantiles count a plant that never settles as the slowest; None where that is one.

    `failing`: on how many plants anything is wrong. `times_limit`: the time in which 99 % settle, over the `limit` [s]
    of the nominal rig at mid stroke.
    """
    columns = kept.lanes  # each is read where it is needed: all at once would be 43 bytes a plant
    settling = columns["settling_s"]
    settling[np.isnan(settling) | columns["tripped"]] = np.inf
    quantiles = settling_quantiles(settling)
    bad = np.sum([weight * columns[key].view(np.uint8) for key, weight in _WEIGHTS.items()], axis=0, dtype=np.uint8)
    lane = int(np.lexsort((np.nan_to_num(columns["ms"], nan=np.inf), settling, bad))[-1])
    unstable = bool(columns["unstable"].any())
    return {
        "controller": kept.spec.name,
        "plants": len(settling),
        **{key: int(columns[key].sum()) for key in ("unstable", "tripped", "hunting")},
        **quantiles,
        "overshoot_worst_percent": finite(np.max(columns["overshoot_percent"])),
        "ms_worst": None if unstable else finite(np.max(columns["ms"])),
        "gain_margin_worst_db": None if unstable else finite(np.fmin.reduce(columns["gain_margin_db"])),
        "failing": int(((bad > 0) | columns["held_unstable"].astype(bool)).sum()),
        "cavitating": int((columns["lowest_pressure"] < 0).sum()),
        "times_limit": times_limit(quantiles["settling_p99_s"], limit),
        "held_unstable": int(columns["held_unstable"].sum()),
        "held_ms_worst": finite(np.fmax.reduce(columns["held_ms"])),
        "worst": _drawn(lane, problem, kept.furthest(lane) if columns["unstable"][lane] else None),
    }


def settling_quantiles(settling: np.ndarray) -> dict[str, float | None]:
    """Of settling times [plants] s, infinite on a plant that never settles: the median, 99 % and the worst."""
    shares = {"p50": 0.5, "p99": 0.99, "worst": 1.0}
    return {f"settling_{name}_s": quantile(settling, share) for name, share in shares.items()}


def _drawn(lane: int, problem: RobustnessProblem, place: Place | None) -> dict[str, float]:
    """The numbers of a plant, and its position: at `place`, else where it was drawn."""
    numbers = drawn(problem, build(problem.rig), range(lane, lane + 1)).plant(0, problem.rig)
    if place is not None and place.position is not None:
        numbers["x [m]"] = place.position
    return numbers
