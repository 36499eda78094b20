"""Noise that remembers: a white part, a slow one of first order, and mains hum, as rooms with drives have it."""

import numpy as np
from scipy.signal import lfilter

from workbench.loop.sensors import draws

from ..trace.campaigns.noise import HUM, MAINS, MEMORY, SLOW, WHITE


class ColouredDraws:
    """Numbers of variance 1 for readings every `period` seconds; a channel has its own, and goes on where it was."""

    def __init__(self, seed: int, lane: int, period: float) -> None:
        self._draws, self._period, self._row = draws(seed, lane), period, 0
        self._slow: np.ndarray | None = None
        self._phase: np.ndarray | None = None

    def standard_normal(self, size: tuple[int, int]) -> np.ndarray:
        """The next [rows, channels]."""
        rows, channels = size
        if self._slow is None or self._phase is None:
            self._slow = MEMORY * self._draws.standard_normal((1, channels))
            self._phase = self._draws.uniform(0, 2 * np.pi, channels)
        pushes = np.sqrt(1 - MEMORY**2) * self._draws.standard_normal(size)
        slow, self._slow = lfilter([1.0], [1.0, -MEMORY], pushes, axis=0, zi=self._slow)
        turns = 2 * np.pi * MAINS * self._period * (self._row + np.arange(rows))
        self._row += rows
        hum = np.sqrt(2) * np.sin(turns[:, None] + self._phase)
        return WHITE * self._draws.standard_normal(size) + SLOW * slow + HUM * hum
