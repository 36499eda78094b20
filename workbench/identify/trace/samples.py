"""Where a campaign was: values of the natural variables of the plant's slots, from what was recorded.

Knots and ranges of refinements are placed on them. They follow from the train records alone, so that a formula's words
give the same effect again when a stopped trace goes on.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...plant import Plant
from ...records import Record

_SMOOTH = 5e-3  # s: over which a speed is taken
_MOST = 4000  # samples of a variable


def variable_samples(plant: Plant, records: Sequence[Record]) -> dict[str, np.ndarray]:
    """Values [n] SI by the word of a natural variable; a variable whose signals no record has is left out."""
    middle = plant.p[plant.parameters.index("xmid")]
    read: Mapping[str, Callable[[Record], np.ndarray]] = {
        "command": lambda r: r.signals["command"],
        "current": lambda r: r.signals["current"],
        "position": lambda r: r.signals["position"] - middle,
        "velocity": lambda r: _speed(r, "position"),
        "spool": lambda r: r.signals["spool"],
        "opening": lambda r: r.signals["spool"],
        "spool_velocity": lambda r: _speed(r, "spool"),
        "pressure": lambda r: np.concatenate([r.signals[name] for name in ("pa", "pb") if name in r.signals]),
        "drop": lambda r: r.signals["pa"] - r.signals["pb"],
        "supply": lambda r: r.signals["supply"],
        "acceleration": lambda r: r.signals["acceleration"],
    }
    samples = {word: [values for r in records if (values := _or_nothing(of, r)).size] for word, of in read.items()}
    return {word: _thinned(np.concatenate(parts)) for word, parts in samples.items() if parts}


def _or_nothing(of: Callable[[Record], np.ndarray], record: Record) -> np.ndarray:
    try:
        return of(record)
    except (KeyError, ValueError):  # a signal that this record lacks
        return np.zeros(0)


def _speed(record: Record, name: str) -> np.ndarray:
    """Slope of a signal over some rows."""
    rows = max(1, round(_SMOOTH / record.period))
    values, t = record.signals[name][::rows], record.t[::rows]
    return np.gradient(values, t) if t.size > 1 else np.zeros(0)


def _thinned(values: np.ndarray) -> np.ndarray:
    return values[:: max(1, values.size // _MOST)]
