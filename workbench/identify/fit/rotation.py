"""What windows say of a fit that was made without them: cross-validation by blocks, without a further fit.

About the optimum the cost of window w is V_w + 2 g_w' d + d' A_w d in a change d of the numbers, the initial state
following. Without the windows of a block b the numbers move by the Gauss-Newton step that the others then ask for,

    d = -(A - A_b + P)^-1 (g - g_b + P x),    A = sum A_w, g = sum g_w, P the prior of the numbers,

within their ranges, and the block's windows then cost what the quadratic says: exact for errors that are linear in the
numbers (Allen's PRESS by blocks; Stone, J. Royal Statistical Society B 36(2), 1974). Where a window is steep the
quadratic says a fall or a rise that is not there: windows that it moves far are simulated with these numbers instead.

A free run is no window for each of its parts: with initial states of their own parts say nothing of what drifts, and
prefer rich models that are wrong. There a block is a part of the rows of every run, and V, g and A are theirs, in the
one run through all rows whose initial state follows the numbers as it does in the fit.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .determined import FreeParameter
from .initial_states import fit_states
from .model import Model
from .normal_equations import Tangents, best_step, costs, numbers_at
from .prior import STIFFNESSES, Prior
from .windows import BLOCKS, Windows, row_blocks

_NEAR = 1.01  # times the least squared errors: where a stiffer curve does as well
_HARM = 0.5  # of the squared errors: far below what noise would tell apart
_SHORTEST = 1e-3  # distance of a step that is not halved any further
_MOVED = 0.2  # of a window's squared errors: what a quadratic may move them by and be believed


@dataclass(frozen=True, eq=False)
class Selection:
    """Squared errors over sigma [parts] of records, or parts of them, that a fit did not see, of `samples` in all."""

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


@dataclass(frozen=True, eq=False)
class Parts:
    """What parts of recordings say of a fit: squared errors V [parts], matrices A [parts, k, k] and gradients g
    [parts, k], and the `block` [parts] that each is left out with; `free_run`: whether they are parts of free runs."""

    squares: np.ndarray
    matrices: np.ndarray
    gradients: np.ndarray
    block: np.ndarray
    free_run: bool = False

    def left_out(self, prior: Prior, x: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Which parts [parts] each block has, and the change of the distances x [k] that the other blocks ask for."""
        for number in np.unique(self.block):
            own = self.block == number
            matrix = self.matrices[~own].sum(axis=0) + prior.matrix
            gradient = self.gradients[~own].sum(axis=0) + prior.gradient(x)
            yield own, best_step(matrix, gradient, x, prior.ends, self.free_run or prior.bends)

    def unseen(self, prior: Prior, x: np.ndarray) -> np.ndarray:
        """The squared errors [parts] with the numbers that the other blocks give, from distances x [k]."""
        after = self.squares.copy()
        for own, step in self.left_out(prior, x):
            after[own] += 2 * self.gradients[own] @ step + np.einsum("i,wij,j->w", step, self.matrices[own], step)
        return np.maximum(after, 0.0)

    def best_stiffness(self, prior: Prior, x: np.ndarray) -> float:
        """The stiffest that curves may be to predict parts from the other ones about best, as far as a fit at distances
        x is linear."""
        unseen = [float(self.unseen(prior.at(stiffness), x).sum()) for stiffness in STIFFNESSES]
        return max(each for each, squares in zip(STIFFNESSES, unseen, strict=True) if squares <= _NEAR * min(unseen))


def parts_of(windows: Windows, squares: np.ndarray, tangents: Tangents) -> Parts:
    """The windows, of squared errors [w], or for free runs blocks of their rows."""
    if not windows.free_run:
        matrices, gradients, *_ = tangents.normal.reduced()
        return Parts(squares, matrices, gradients, blocks(windows))
    parts = []
    for slopes, whole in zip(tangents.reduced, tangents.errors, strict=True):
        block = np.repeat(row_blocks(whole.shape[1]), whole.shape[2])
        for slope, error in zip(slopes, whole.reshape(len(whole), -1), strict=True):
            own = ((slope[block == number], error[block == number]) for number in range(BLOCKS))
            parts += [(e @ e, j.T @ j, j.T @ e) for j, e in own]
    own_squares, matrices, gradients = (np.array(column) for column in zip(*parts, strict=True))
    return Parts(own_squares, matrices, gradients, np.tile(np.arange(BLOCKS), windows.count), free_run=True)


def unseen_squares(
    model: Model,
    windows: Windows,
    free: Sequence[FreeParameter],
    place: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    tangents: Tangents,
    prior: Prior,
) -> np.ndarray:
    """The squared errors [parts] of a fit at a `place` (x, p, x0, squares) with the numbers that the other blocks give.

    Windows that the quadratic moves far are simulated, their initial states fitted, with as much of the step as does
    the other windows no harm; one that cannot be simulated is believed the quadratic.
    """
    x, p, x0, squares = place
    parts = parts_of(windows, squares, tangents)
    if parts.free_run:
        return parts.unseen(prior, x)
    following = tangents.normal.reduced()[2]

    def moved(which: np.ndarray, step: np.ndarray) -> tuple[Windows, np.ndarray, np.ndarray]:
        """Windows, initial states that follow a step of the numbers to first order, and the parameters."""
        change = following[which] @ step * model.plant.scale if following.shape[1] == x0.shape[1] else 0.0
        some = windows.some(np.flatnonzero(which).tolist())
        return some, x0[which] - change, numbers_at(model, free, x + step, p)

    return simulated_where_far(
        parts, prior, x,
        lambda others, step: _left(model, *moved(others, step)),
        lambda own, step: fit_states(model, *moved(own, step))[1],
    )  # fmt: skip


def simulated_where_far(
    parts: Parts,
    prior: Prior,
    x: np.ndarray,
    left: Callable[[np.ndarray, np.ndarray], float],
    simulated: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> np.ndarray:
    """The squared errors [parts] with the numbers that the other blocks give, simulated where the quadratic moves them
    far: `left` and `simulated` are those of some parts, in all and each, after a step of the numbers from x."""
    unseen = parts.unseen(prior, x)
    far = np.abs(unseen - parts.squares) > _MOVED * parts.squares
    if not far.any():
        return unseen
    for own, step in parts.left_out(prior, x):
        if not np.any(own & far) or own.all():
            continue
        others, most = ~own, float(parts.squares[~own].sum()) + _HARM
        while np.any(step) and not left(others, step) < most:
            step = step / 2 if np.abs(step).max() > _SHORTEST else np.zeros_like(step)
        errors = simulated(own & far, step)
        unseen[own & far] = np.where(np.isfinite(errors), errors, unseen[own & far])
    return unseen


def _left(model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray) -> float:
    return float(costs(model, windows, x0, p, x0)[1].sum())
