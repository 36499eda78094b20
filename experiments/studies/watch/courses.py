"""Courses of wears that are drawn: how often does a forecast's 80 % interval hold the day on which a limit is passed?

Only the simulation of recordings is left out: what a fit says of a wear's size is far sharper than wears are steady.
"""

from collections.abc import Mapping
from typing import get_args

import numpy as np

from workbench.identify.watch.changes import Change
from workbench.identify.watch.forecast import interval, passes
from workbench.identify.watch.naming import Name
from workbench.identify.watch.told import NamedChange, fitted_sessions

from .made_rig import WEEK, Pace

_NAME = "wear"
_READ = 0.01  # of a limit: the standard deviation of a size
_LONGEST = 260  # sessions


def coverage(number: int, seed: int) -> dict[str, dict[str, float]]:
    """For each pace of growth: forecasts made, and the share whose interval holds the true day."""
    found = {}
    for pace in get_args(Pace):
        random = np.random.default_rng([seed, len(pace)])
        held = [each for each in (_held(random, pace) for _ in range(number)) if each is not None]
        found[pace] = {"forecasts": len(held), "held": float(np.mean(held))}
    return found


def drawn_course(random: np.random.Generator, pace: Pace) -> np.ndarray:
    """Sizes [sessions] over the limit of a wear that grows from session 0 on, 1 where the limit is."""
    weeks = np.arange(1.0, _LONGEST + 1)
    lasts = random.uniform(12, 60)
    if pace == "unsteady":
        return np.cumsum(random.gamma(1 / 0.6**2, 0.6**2, _LONGEST)) / lasts
    return (weeks / lasts) ** (1.0 if pace == "steady" else random.uniform(1.2, 1.8))


def _held(random: np.random.Generator, pace: Pace) -> bool | None:
    """Whether a forecast, made at some size below the limit, holds the day; None where none is made."""
    course = drawn_course(random, pace)
    truth = int(np.argmax(course >= 1.0))
    now = int(random.uniform(0.3, 0.9) * truth)
    if now < 6:
        return None
    at = fitted_sessions(0, now + 1)
    days = WEEK * np.arange(now + 1.0)
    sizes = {t: float(course[t] + _READ * random.standard_normal()) for t in at}
    told = _told(sizes, days)
    ahead = np.linspace(0.0, 3 * 365.25, 120)
    sized = [told.numbers_at(days[-1] + day, days)[_NAME] for day in ahead]
    day = passes(ahead, sized, 1.0, 1)
    if day is None:
        return None
    low, high = interval(day, told.unsteady(day))
    return low <= WEEK * (truth - now) <= high


def _told(sizes: Mapping[int, float], days: np.ndarray) -> NamedChange:
    numbers = {t: {_NAME: size} for t, size in sizes.items()}
    change = Change(0, "drift", 1, 1.0, 1.0, 1, 1)
    course = {t: (size, _READ) for t, size in sizes.items()}
    at = {t: float(days[t]) for t in sizes}
    return NamedChange(change, 0, Name(_NAME, (_NAME,), 1.0), _NAME, course, numbers, None, "", (_NAME,), at)
