"""What a specimen's moving far end costs a force loop."""

import numpy as np

from .sampled_loop import LoopRun
from .scenarios import Scenario

_STEADY = 0.1  # s: over which a force error is a mean


def error_per_speed(scenario: Scenario, run: LoopRun) -> float | None:
    """Force error [N] that a far end at constant speed adds, over that speed [m/s]; None for a loop that tripped.

    `scenario` is one with a `travel`. Means over the last 0.1 s before the far end leaves and before it slows down.
    """
    if run.tripped is not None:
        return None
    t, signals = run.record.t, run.record.signals
    speed = scenario.inputs(t)["specimen_velocity"]
    leaves, slows = t[np.flatnonzero(speed > 0)[0]], t[np.flatnonzero(speed > 0.999 * scenario.speed)[-1]]
    error = signals["reference"] - signals["force"]
    standing, moving = (np.mean(error[(t > end - _STEADY) & (t < end)]) for end in (leaves, slows))
    return float((moving - standing) / scenario.speed)
