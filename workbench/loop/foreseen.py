"""Whether a motion stays clear of a rig's limits, of what it does in simulation."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..records.excitation import Excitation
from ..rigs.limited import limits_of, nearest_limit
from ..rigs.rig import Rig

_ENDS = 0.3  # s after a motion: one that ends in full speed shakes the jack then
MARGIN = 0.05  # of a limit: nothing that is foreseen may come nearer to it


def with_end(course: np.ndarray, period: float, after: float | None = None) -> np.ndarray:
    """A reference, or a command that is added, [k] with what follows it: its last value, unless another is given."""
    return np.append(course, np.full(round(_ENDS / period), course[-1] if after is None else after))


def wave_with_end(wave: Excitation) -> Excitation:
    """An excitation, with the rest that follows it."""
    reference = with_end(wave.reference, wave.period)
    return replace(wave, reference=reference, command=with_end(wave.command, wave.period, 0.0))


def beyond(rig: Rig, signals: Mapping[str, np.ndarray]) -> tuple[str, int] | None:
    """Which limit signals [lanes, k] by name come too near to, furthest first, in words, and the lane; None where all
    stay clear of all. Of a further limit that is also where the guard's next sample is foreseen beyond it."""
    nearest = nearest_limit(limits_of(rig), signals)
    if nearest is not None and nearest.share > 1 - MARGIN:
        return nearest.limit.text(nearest.value), nearest.lane
    for limit in rig.further_limits:
        values = signals.get(limit.signal, np.zeros((0, 2)))
        lanes, samples = np.nonzero(~limit.holds(values[:, 1:], np.diff(values)))
        if len(lanes):
            return limit.text(float(values[lanes[0], samples[0] + 1])), int(lanes[0])
    return None


def emptied(signals: Mapping[str, np.ndarray]) -> str | None:
    """Whether a chamber falls below 0 bar in signals [.., k], where no model holds, in words."""
    lowest = float(signals["lowest_pressure"].min())
    return f"a chamber falls to {lowest / 1e5:.3g} bar" if lowest < 0 else None
