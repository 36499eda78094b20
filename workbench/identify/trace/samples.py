"""Where a campaign was: values of the natural variables of the plant's slots, from what was recorded.

Knots and ranges of refinements are placed on them. They follow from the train records alone, so that a formula's words
give the same effect again when a stopped trace goes on.
"""

from collections.abc import Sequence

import numpy as np

from ...plant.effects.natural import natural_samples
from ...records import Record
from ...rigs.rig import Rig

_SMOOTH = 0.02  # s: over which a speed is taken
_MOST = 4000  # samples of a variable


def variable_samples(rig: Rig, records: Sequence[Record]) -> dict[str, np.ndarray]:
    """Values [n] SI by the word of a natural variable; a variable whose signals no record has is left out."""
    every = [_of(rig, record) for record in records]
    words = dict.fromkeys(word for own in every for word in own)
    return {word: _thinned(np.concatenate([own[word] for own in every if word in own])) for word in words}


def _of(rig: Rig, record: Record) -> dict[str, np.ndarray]:
    signals = dict(record.signals)
    if "position" in signals:
        signals["velocity"] = _speed(record, "position")
    samples = natural_samples(rig, signals)
    if "spool" not in signals and "z3max" in rig.numbers:  # a spool is about where the command puts it
        samples["opening"] = signals["command"] * rig["z3max"]
    return samples | ({"spool_velocity": _speed(record, "spool")} if "spool" in signals else {})


def _speed(record: Record, name: str) -> np.ndarray:
    """Slope of a signal over some rows."""
    rows = min(max(1, round(_SMOOTH / record.period)), record.t.size - 1)
    values = record.signals[name]
    return (values[rows:] - values[:-rows]) / (record.t[rows:] - record.t[:-rows])


def _thinned(values: np.ndarray) -> np.ndarray:
    return values[:: max(1, values.size // _MOST)]
