"""Years of healthy rigs, drawn from what the sessions of one tell: how often does a watch raise an alarm?

A session of a healthy rig is its information A and a move q. Only the simulation of recordings is left out. Years are
drawn twice: of the moves that the sessions themselves show, in blocks, and of moves by laws that the watch does not
assume. In these the oil has a season and a daily wander, and the supply comes back slowly from larger steps than a
normal law has.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from workbench.identify.watch.changes import first_told
from workbench.identify.watch.history import History
from workbench.identify.watch.smoothed import smoothed

from .made_rig import DAILY, PER_KELVIN, SEASON, WEEK

SESSIONS = 52  # a year, once a week
_SUPPLY_AXIS = "Ps"
_BLOCK = 4  # sessions that stay together
_KEPT = 0.6  # of the supply's offset, from session to session
Draw = Callable[[History, np.random.Generator], History]


def false_alarms(known: History, years: int, a_year: float, draw: Draw, seed: int = 0) -> int:
    """How many of so many drawn years, a rig each, have an alarm where the rate asked for is `a_year`."""
    random = np.random.default_rng(seed)
    return sum(first_told(draw(known, random), a_year)[0] is not None for _ in range(years))


def resampled_year(known: History, random: np.random.Generator) -> History:
    """A healthy year of the moves and temperatures that blocks of the sessions have, and noise as theirs."""
    starts = random.integers(0, len(known.days) - _BLOCK + 1, SESSIONS // _BLOCK)
    which = (starts[:, None] + np.arange(_BLOCK)).ravel()
    kelvin = None if known.kelvin is None else known.kelvin[which]
    return _year(known, which, smoothed(known)[0][which], kelvin, random)


def drawn_year(known: History, random: np.random.Generator, supply: float) -> History:
    """A healthy year with the information of the sessions of `known`, drawn at random; its supply wanders by a share
    `supply` of the pressure, and its oil is recorded if theirs is."""
    which = random.integers(0, len(known.days), SESSIONS)
    days = WEEK * np.arange(SESSIONS, dtype=float)
    kelvin = SEASON * np.sin(2 * np.pi * days / 365.25 + random.uniform(0, 2 * np.pi))
    kelvin = kelvin + DAILY * random.standard_normal(SESSIONS)
    steps, offsets = random.laplace(0.0, supply * np.sqrt((1 - _KEPT**2) / 2), SESSIONS), np.zeros(SESSIONS)
    for t in range(1, SESSIONS):
        offsets[t] = _KEPT * offsets[t - 1] + steps[t]
    moves = np.zeros((SESSIONS, len(known.axes)))
    for k, axis in enumerate(known.axes):
        moves[:, k] = PER_KELVIN.get(axis.name, 0.0) * abs(axis.value) / axis.scale * kelvin
        if axis.name == _SUPPLY_AXIS:
            moves[:, k] = abs(axis.value) / axis.scale * offsets
    return _year(known, which, moves, None if known.kelvin is None else kelvin, random)


def _year(
    known: History, which: np.ndarray, moves: np.ndarray, kelvin: np.ndarray | None, random: np.random.Generator
) -> History:
    matrix, count = known.matrix[which], len(which)
    vector = np.einsum("tij,tj->ti", matrix, moves) + _noise(matrix, random)
    days, stretch = WEEK * np.arange(count, dtype=float), np.zeros(count, dtype=int)
    return replace(known, days=days, matrix=matrix, vector=vector, stretch=stretch, kelvin=kelvin)


def _noise(matrix: np.ndarray, random: np.random.Generator) -> np.ndarray:
    values, vectors = np.linalg.eigh(matrix)
    drawn = np.sqrt(np.maximum(values, 0.0)) * random.standard_normal(values.shape)
    return np.einsum("tij,tj->ti", vectors, drawn)
