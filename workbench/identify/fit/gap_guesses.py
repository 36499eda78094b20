"""Guesses of a state in which something rattles: where in its gap it is, and the jack where its sensor reads it."""

from itertools import product

import numpy as np

from ...engine import Engine
from ...plant.effects.slots import ORIGINS, READS

_PLACES = (-0.5, -0.25, 0.0, 0.25, 0.5)  # of a gap, about its middle: where a window may begin in it, and
_SPEEDS = (-2.0, -0.6, 0.0, 0.6, 2.0)  # of the speed's scale: how fast


def in_view(engine: Engine, p: np.ndarray) -> bool:
    """Whether the position's sensor is on what moves across a gap, with parameters p [parameters]: only then a window
    tells where in its gap it begins."""
    x = np.tile(engine.plant.start, (2, 1))
    for column, *_ in engine.plant.gaps:
        x[1, column] += engine.plant.scale[column]
    still, moved = _read(engine, x, np.tile(p[: len(engine.plant.parameters)], (2, 1)))
    return bool(moved != still)


def across_gaps(engine: Engine, x: np.ndarray, p: np.ndarray) -> list[np.ndarray]:
    """States as x [k, n], with parameters p [k, parameters], with what moves across a gap anywhere in it, at rest and
    at some speeds, and the position read as at x."""
    read, others = _read(engine, x, p), []
    for share, speed in product(_PLACES, _SPEEDS):
        moved = x.copy()
        for column, pace, width in engine.plant.gaps:
            moved[:, column], moved[:, pace] = share * p[:, width], speed * engine.plant.scale[pace]
        others.append(_reading(engine, moved, p, read))
    return others


def read_on_the_load(engine: Engine, x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """States x [k, n], in which the jack is where its position was measured, with it where its sensor then reads that:
    the sensor may be on what rattles."""
    jack = x[:, engine.plant.state(READS["position"])] + p[:, engine.plant.parameters.index(ORIGINS["position"])]
    return _reading(engine, x, p, jack)


def _read(engine: Engine, x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """What the position's sensor reads [k] at states x [k, n]."""
    still = np.zeros((len(x), 1, len(engine.plant.inputs)))
    return engine.outputs(x[:, None], still, p[:, None])[:, 0, engine.plant.output("position")]


def _reading(engine: Engine, x: np.ndarray, p: np.ndarray, position: np.ndarray) -> np.ndarray:
    """States x [k, n] with the jack where its sensor reads a position [k]."""
    x = x.copy()
    x[:, engine.plant.state(READS["position"])] += position - _read(engine, x, p)
    return x
