"""The limit of a reference that moves: the least error that an optimiser finds for a known rig.

A ramp, a sine, a recorded course, all of it known ahead. By direct collocation in windows, played on the engine, with
commands held over the control period, then over half of it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..engine import nearest
from ..engine.nearest import RecedingHorizon, Wish, nearest_course
from ..rigs.rig import Rig
from .capability import oil_stiffness
from .limit import BELOW, NO_CHAMBERS, kept, motion_from, signals_of
from .scenarios import Scenario

_INTERVAL = 1e-3  # s: the longest; a longer one does not resolve the spool
_PLAYED, _AHEAD = 20, 80  # intervals of a window
_RESERVE = 2e5  # Pa: pressure that the windows keep more, for the engine to keep the bound
_NOTHING = 1e-3  # of what the reference moves in a period of the oil: an error that is none
_SOURCES = (__file__, nearest.__file__)


@dataclass(frozen=True, eq=False)
class TrackingLimit:
    """The least root mean square of the `error` (SI) over a scenario; None where none was found, and the `reason`.

    `mesh_difference` (SI) is its difference on two meshes, None where there is but one; `largest` the greatest error
    of that motion, with its `lowest_pressure` [Pa], `peak_command` and `signals` [k] by name, SI, with "t [s]".
    """

    reason: str = ""
    error: float | None = None
    mesh_difference: float | None = None
    largest: float | None = None
    lowest_pressure: float | None = None
    peak_command: float | None = None
    signals: Mapping[str, np.ndarray] = field(default_factory=dict)


def tracking_limit(rig: Rig, scenario: Scenario, margin: float = 0.0) -> TrackingLimit:
    """The least error of a scenario with chambers at least `margin` [Pa] above 1 atm, where gas comes out.

    The jack begins at rest where the scenario starts; the command stays within +-1 and the rig's rate, the jack within
    stroke and speed. The reference is known ahead, so that a late drive costs nothing. It is computed once, in some ten
    seconds a second of the scenario, and kept in the user's cache folder. Raises InputError where the rig has no
    operating point there.
    """
    if reason := _no_limit(rig, scenario):
        return TrackingLimit(reason)
    wish = _wish(rig, scenario, margin)
    if np.any(wish.motion.x < wish.motion.low):
        return TrackingLimit(BELOW)
    interval = min(rig.period.value, _INTERVAL)
    asked = wish.reference(np.arange(round(wish.duration / interval) + 1) * interval)
    numbers = [asked, np.array([wish.duration, wish.size, interval])]
    return kept(TrackingLimit, lambda: _found(wish, interval), wish.motion, wish.output, numbers, _SOURCES)


def tracking_limits_by_name(rig: Rig, scenarios: Iterable[Scenario]) -> dict[str, float | None]:
    """Least errors (SI) of scenarios by name; None where there is none, or it was not found."""
    return {scenario.name: tracking_limit(rig, scenario).error for scenario in scenarios}


def _no_limit(rig: Rig, scenario: Scenario) -> str:
    """Why a scenario has no least error; empty where it has one."""
    if not rig.is_jack:
        return NO_CHAMBERS
    if scenario.load or scenario.travel:
        return "a load or a far end that moves is not in it"
    if scenario.is_step or not scenario.size:
        return "no reference that moves"
    return ""


def _wish(rig: Rig, scenario: Scenario, margin: float) -> Wish:
    motion, level = motion_from(rig, scenario, margin + _RESERVE)
    step = np.arange(round(scenario.duration / _INTERVAL) + 1) * _INTERVAL
    fastest = float(np.abs(np.diff(scenario.reference(step))).max()) / _INTERVAL
    oil = 2 * np.pi * float(np.sqrt(rig["M"] / oil_stiffness(rig)))

    def reference(t: np.ndarray) -> np.ndarray:
        return level + scenario.reference(t.ravel()).reshape(t.shape)

    return Wish(motion, scenario.signal, reference, scenario.duration, min(abs(scenario.size), fastest * oil))


def _found(wish: Wish, interval: float) -> TrackingLimit:
    """On the first mesh, and on one of half its intervals where that is not zero: the better, for both were played."""
    limit = _played(wish, interval, 1)
    if limit.error is None or limit.error < _NOTHING * wish.size:
        return limit
    finer = _played(wish, interval, 2)
    if finer.error is None:
        return limit
    return replace(min(limit, finer, key=_error), mesh_difference=abs(finer.error - limit.error))


def _error(limit: TrackingLimit) -> float:
    return np.inf if limit.error is None else limit.error


def _played(wish: Wish, interval: float, parts: int) -> TrackingLimit:
    course = nearest_course(wish, RecedingHorizon(interval / parts, parts * _PLAYED, parts * _AHEAD))
    if course is None:
        return TrackingLimit("the solver finds no motion")
    signals = signals_of(wish.motion, course.t, course.x, course.u)
    off = signals[wish.output] - wish.reference(course.t)
    error = float(np.sqrt(np.mean(off**2)))
    return TrackingLimit(
        error=error,
        largest=float(np.abs(off).max()),
        lowest_pressure=float(signals["lowest_pressure"].min()),
        peak_command=float(np.abs(course.u[:, 0]).max()),
        signals={**signals, "reference": wish.reference(course.t)},
    )
