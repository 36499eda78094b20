"""Motions from rest to rest of an experiment's own: keys `profile`, `speed`, `acceleration`, `jerk` of a scenario."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.table import ConfigTable
from ...base.units import Spec
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig

if TYPE_CHECKING:
    from ...loop.capability import Capability
    from ...loop.trajectories import MotionProfile

PROFILES = ("jerk-limited", "time-optimal")
SECONDS = Spec("s", 1e-3, 1e6, "how long it is watched")
_LIMITS = {"speed": "m/s", "acceleration": "m/s^2", "jerk": "m/s^3"}
_WATCHED = 1.0  # s: after it arrives
_ROUNDING = 1 + 1e-9


def read_profile(name: str, table: ConfigTable, size: float, rig: Rig, further: Mapping[str, Any]) -> Scenario:
    """A motion by `size` [m] within the limits of its table, the rig's where it has none. Raises InputError."""
    trajectory = _trajectory(table, size, rig, float(further["load"]))
    period = rig.period.value
    t = np.arange(int(np.ceil(trajectory.duration / period)) + 1) * period
    duration = trajectory.duration + _WATCHED
    if "seconds" in table:
        duration = table.quantity("seconds", SECONDS)
    waveform = tuple(t.tolist()), tuple(trajectory.at(t)[0].tolist())
    return Scenario(name, "position", size, duration, waveform=waveform, stands=float(t[-1]), **further)


def _trajectory(table: ConfigTable, size: float, rig: Rig, load: float) -> "MotionProfile":
    from ...loop.capability import SHARE, capability
    from ...loop.trajectories import jerk_limited, time_optimal

    kind = table.word("profile", PROFILES)
    if kind == "time-optimal" and "jerk" in table:
        raise table.complaint("jerk", "a time-optimal motion has no limit of jerk; remove it")
    limits = {key: table.quantity(key, Spec(si, 1e-6, 1e12, key)) for key, si in _LIMITS.items() if key in table}
    share, full = (capability(rig, part, load) for part in (SHARE, 1.0))
    if share.a0 <= 0:
        raise table.complaint("load", f"leaves {rig.name} no force to accelerate with; ask for less")
    _check_limits(table, limits, full, rig)
    if kind == "time-optimal":
        fastest = min(share.limit, share.v0 * (1 - 1e-6))
        speed, acceleration = limits.get("speed", fastest), limits.get("acceleration", np.inf)
        return time_optimal(size, min(speed, fastest), acceleration, share.a0, share.v0)
    speed, acceleration = _corner(limits, share)
    if acceleration <= 0:
        raise table.complaint("speed", "leaves no force to accelerate with; ask for less, or give an acceleration")
    return jerk_limited(size, speed, acceleration, limits.get("jerk", acceleration * share.mode))


def _corner(limits: Mapping[str, float], share: "Capability") -> tuple[float, float]:
    """Speed and acceleration of a motion that may have both at once."""
    if len(given := {key: limits[key] for key in ("speed", "acceleration") if key in limits}) == 2:
        return given["speed"], given["acceleration"]
    if "speed" in given:
        return given["speed"], float(share.acceleration(given["speed"]))
    if "acceleration" in given:
        return share.speed(given["acceleration"]), given["acceleration"]
    return share.corner


def _check_limits(table: ConfigTable, limits: Mapping[str, float], full: "Capability", rig: Rig) -> None:
    """Raises InputError for a limit beyond what the rig has."""
    speed = limits.get("speed", 0.0)
    if speed > min(full.limit, full.v0) * _ROUNDING:
        raise table.complaint("speed", f"{rig.name} has {min(full.limit, full.v0):.4g} m/s; ask for less")
    least = full.a0 if table.text("profile") == "time-optimal" else float(full.acceleration(speed))
    if limits.get("acceleration", 0.0) > least * _ROUNDING:
        at = f" at {speed:g} m/s" if speed else ""
        raise table.complaint("acceleration", f"{rig.name} has {least:.4g} m/s^2{at}; ask for less")
