"""The state of a jack that rests: where it is measured to be, its stores as its numbers say, all else at its start."""

import numpy as np

from ...engine import Engine
from ...plant.effects.slots import READS
from ...records import Record
from .windows import FIRST_ROWS

_ROUNDS, _EXACT = 12, 1e-9  # of corrections, for transducers with a curve, and of a reading, when that ends
_SHOWN = ("pa", "pb", "position")  # what every record of a free run has


def rest_state(engine: Engine, record: Record, p: np.ndarray) -> np.ndarray:
    """The state [n] at the first row of a record that rests there, with parameters [k].

    What the plant reads of pressures and position is what the first rows measure on the average.
    """
    plant = engine.plant
    x = plant.start
    for column, state in enumerate(plant.states):
        if state.number:
            x[column] = p[plant.parameters.index(state.number)]
    shown = {}
    for signal in _SHOWN:
        rows = record.valid[signal][:FIRST_ROWS]
        shown[signal] = np.mean(record.signals[signal][:FIRST_ROWS][rows])
    for _ in range(_ROUNDS):
        read = engine.observe(x, np.zeros(len(plant.inputs)), p)
        off = {signal: mean - read[plant.output(signal)] for signal, mean in shown.items()}
        for signal, far in off.items():
            x[plant.state(READS[signal])] += far
        x = plant.following(x)
        if all(abs(far) <= _EXACT * abs(shown[signal]) for signal, far in off.items()):
            break
    return x
