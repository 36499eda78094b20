"""What windows say of a fit that was made without them: cross-validation by blocks, without a further fit.

About the optimum the cost of window w is V_w + 2 g_w' d + d' A_w d in a change d of the numbers, the initial state
following. Without the windows of a block b the numbers move by the Gauss-Newton step that the others then ask for,

    d = -(A - A_b + P)^-1 (g - g_b + P x),    A = sum A_w, g = sum g_w, P the prior of the numbers,

within their ranges, and the block's windows then cost what the quadratic says: exact for errors that are linear in the
numbers (Allen's PRESS by blocks; Stone, J. Royal Statistical Society B 36(2), 1974).
"""

from dataclasses import dataclass

import numpy as np

from .normal_equations import bounded_step, ranges
from .solver import Fit
from .windows import Windows

BLOCKS = 4


@dataclass(frozen=True, eq=False)
class Selection:
    """Squared errors over sigma [windows] of records, or parts of them, that a fit did not see, of `samples` in all."""

    squares: np.ndarray
    samples: int


def blocks(windows: Windows) -> np.ndarray:
    """The block [w] of each window: every record falls into BLOCKS parts of equal length, one a block.

    So each block has a part of every record, and repeats of a record fall apart in the same way.
    """
    index, start, end = np.array(windows.spans).T
    block = np.empty(windows.count, int)
    for record in np.unique(index):
        own = index == record
        share = (start[own] + end[own] - 2 * start[own].min()) / (2 * (end[own].max() - start[own].min()))
        block[own] = (BLOCKS * share).astype(int)
    return block


def rotated(fit: Fit, block: np.ndarray) -> Selection:
    """The squared errors of each window with the numbers that the windows of other blocks give; `block` is [w]."""
    squares = fit.squares.copy()
    if not fit.ok or not fit.free:
        return Selection(squares, fit.samples)
    low, high, width = ranges(fit.free)
    prior = np.diag(width**-2)
    for number in np.unique(block):
        own = block == number
        matrix = fit.matrices[~own].sum(axis=0) + prior
        gradient = fit.gradients[~own].sum(axis=0) + prior @ fit.x
        step = bounded_step(matrix, gradient, fit.x, (low, high))
        squares[own] += 2 * fit.gradients[own] @ step + np.einsum("i,wij,j->w", step, fit.matrices[own], step)
    return Selection(np.maximum(squares, 0.0), fit.samples)
