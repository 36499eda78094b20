"""The white part of a signal's noise, without any record at rest."""

from collections.abc import Iterable

import numpy as np

from ...records import Record

BLOCK = 50  # rows


def white_part(name: str, records: Iterable[Record]) -> float:
    """sigma from third differences, as rms over blocks of 50 rows and their median, which passes over moves."""
    squares = [np.zeros(0)]
    for record in records:
        valid = np.convolve(record.valid[name], np.ones(4), "valid") == 4.0
        third = np.diff(record.signals[name], 3)[valid] ** 2 / 20.0  # 1 + 9 + 9 + 1
        squares.append(third[: third.size // BLOCK * BLOCK].reshape(-1, BLOCK).mean(axis=1))
    blocks = np.concatenate(squares)
    return float(np.sqrt(np.median(blocks))) if blocks.size else 0.0
