"""Whether a motion stays clear of a rig's limits, of what it does in simulation."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..records.excitation import Excitation
from ..rigs.limited import limits_of, nearest_limit
from ..rigs.rig import Rig
from .scenarios import Scenario

_ENDS = 0.3  # s after a motion: one that ends in full speed shakes the jack then
MARGIN = 0.05  # of a limit: nothing that is foreseen may come nearer to it


def with_end(course: np.ndarray, period: float, after: float | None = None) -> np.ndarray:
    """A reference, or a command that is added, [k] with what follows it: its last value, unless another is given."""
    return np.append(course, np.full(round(_ENDS / period), course[-1] if after is None else after))


def wave_with_end(wave: Excitation) -> Excitation:
    """An excitation, with the rest that follows it."""
    reference = with_end(wave.reference, wave.period)
    return replace(wave, reference=reference, command=with_end(wave.command, wave.period, 0.0))


def scenario_with_end(scenario: Scenario, period: float) -> Scenario:
    """A scenario with the rest that follows it, where it does not end at rest."""
    if scenario.arrives is not None:
        return scenario
    t = np.arange(round(scenario.duration / period) + 1) * period
    course = tuple(t.tolist()), tuple(scenario.reference(t).tolist())
    return replace(scenario, duration=scenario.duration + _ENDS, frequency=None, waveform=course, stands=None)


def beyond(rig: Rig, signals: Mapping[str, np.ndarray], tripped: str | None) -> str | None:
    """Why the guard `tripped`, if it did, after which signals tell nothing; else which limit signals [.., k] by name
    come too near to, furthest first, in words; None where all stay clear of all."""
    if tripped is not None:
        return f"{tripped} is foreseen"
    nearest = nearest_limit(limits_of(rig), signals)
    if nearest is None or nearest.share <= 1 - MARGIN:
        return None
    return f"{nearest.limit.text(nearest.value)} is foreseen"


def emptied(signals: Mapping[str, np.ndarray]) -> str | None:
    """Whether a chamber falls below 0 bar, where no model holds, in words."""
    lowest = float(signals["lowest_pressure"].min())
    return f"a chamber falls to {lowest / 1e5:.3g} bar" if lowest < 0 else None
