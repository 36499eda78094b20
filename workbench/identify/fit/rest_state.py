"""The state of a jack that rests: where it is measured to be, its stores as its numbers say, all else at its start."""

import numpy as np

from ...engine import Engine
from ...plant.effects.slots import READS
from ...records import Record
from .windows import FIRST_ROWS

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
    read = engine.observe(x, np.zeros(len(plant.inputs)), p)
    for signal in _SHOWN:
        rows = record.valid[signal][:FIRST_ROWS]
        mean = np.mean(record.signals[signal][:FIRST_ROWS][rows])
        x[plant.state(READS[signal])] += mean - read[plant.output(signal)]
    return plant.following(x)
