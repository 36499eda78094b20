"""Years of healthy rigs, drawn from what the sessions of one tell: how often does a watch raise an alarm?

A session of a healthy rig is its information A and a move q: the oil has a season and a daily wander, the supply and
the transducers wander, the noise is that of the recordings. Only the simulation of recordings is left out.
"""

from dataclasses import replace

import numpy as np

from workbench.identify.watch.changes import first_told
from workbench.identify.watch.history import History

from .made_rig import DAILY, PER_KELVIN, SEASON, SUPPLY, WEEK

SESSIONS = 52  # a year, once a week
_SUPPLY_AXIS = "Ps"


def false_alarms(known: History, years: int, a_year: float, seed: int = 0) -> int:
    """How many of so many drawn years, a rig each, have an alarm where the rate asked for is `a_year`."""
    random = np.random.default_rng(seed)
    return sum(first_told(drawn_year(known, random), a_year)[0] is not None for _ in range(years))


def drawn_year(known: History, random: np.random.Generator) -> History:
    """A healthy year with the information of the sessions of `known`, drawn at random; its oil is recorded."""
    which = random.integers(0, len(known.days), SESSIONS)
    matrix, days = known.matrix[which], WEEK * np.arange(SESSIONS, dtype=float)
    kelvin = SEASON * np.sin(2 * np.pi * days / 365.25 + random.uniform(0, 2 * np.pi))
    kelvin = kelvin + DAILY * random.standard_normal(SESSIONS)
    moves = np.zeros((SESSIONS, len(known.axes)))
    for k, axis in enumerate(known.axes):
        moves[:, k] += PER_KELVIN.get(axis.name, 0.0) * abs(axis.value) / axis.scale * kelvin
        if axis.name == _SUPPLY_AXIS:
            moves[:, k] += SUPPLY * abs(axis.value) / axis.scale * random.standard_normal(SESSIONS)
    vector = np.einsum("tij,tj->ti", matrix, moves) + _noise(matrix, random)
    stretch = np.zeros(SESSIONS, dtype=int)
    return replace(known, days=days, matrix=matrix, vector=vector, stretch=stretch, kelvin=kelvin)


def _noise(matrix: np.ndarray, random: np.random.Generator) -> np.ndarray:
    values, vectors = np.linalg.eigh(matrix)
    drawn = np.sqrt(np.maximum(values, 0.0)) * random.standard_normal(values.shape)
    return np.einsum("tij,tj->ti", vectors, drawn)
