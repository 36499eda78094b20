"""Initial states of windows for numbers that stay: each window by itself, by damped Gauss-Newton steps."""

from collections.abc import Sequence

import numpy as np

from .gap_guesses import in_view
from .model import Model
from .normal_equations import FIRST_DAMPING, Normal, costs, normal_equations
from .windows import FIRST_ROWS, Windows

_STATE_ROUNDS = 12
_STATE_ENOUGH = 0.02  # a window whose cost falls less is done
_MOST_DAMPING = 1e6
REFRESHED, _REFRESH_ROUNDS = 2, 4  # how often guesses are made anew, and rounds of their states
_MISFITS = 3  # times that what a free run misses is asked for
_CAUGHT = 0.9  # of its squared errors: below which a window is gone on from the new guess
_LONGER = ((0.05, 3), (0.2, 3), (0.5, 2), (1.0, 1))  # of a window that is fitted, and of how many guesses, at first
_BRIEFLY = 4  # rounds of each


def fit_states(
    model: Model, windows: Windows, guess: np.ndarray, p: np.ndarray, rounds: int = _STATE_ROUNDS
) -> tuple[np.ndarray, np.ndarray]:
    """The initial states [w, n] that fit each window best, and the squared errors [w]; p stays."""
    x0 = guess.copy()
    cost, squares = costs(model, windows, x0, p, guess)
    damping = np.full(windows.count, FIRST_DAMPING)
    active = np.isfinite(cost) & (not windows.from_rest)
    normal = None
    for _ in range(rounds):
        keep = np.flatnonzero(active)
        if not keep.size:
            break
        if normal is None:
            normal = normal_equations(model, windows, x0, p, guess, (), np.zeros(0), keep)
        step = state_step(normal, damping[keep])
        trial = x0.copy()
        trial[keep] -= step * model.plant.scale
        part = windows.some(keep.tolist()) if keep.size < windows.count else windows
        trial_cost, trial_squares = costs(model, part, trial[keep], p, guess[keep])
        better = trial_cost < cost[keep]
        fall = np.where(better, 1 - trial_cost / np.maximum(cost[keep], 1e-300), 1.0)
        taken = keep[better]
        x0[taken], cost[taken], squares[taken] = trial[taken], trial_cost[better], trial_squares[better]
        damping[keep] = np.where(better, damping[keep] / 10, damping[keep] * 30)
        active[keep] = (fall > _STATE_ENOUGH) & (damping[keep] < _MOST_DAMPING)
        normal = None
    return x0, squares


def predicted_states(model: Model, windows: Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Initial states [w, n] with the least errors for numbers that stay, and the squared errors [w]."""
    if _rattles(model, windows, p):
        return fit_states(model, windows, _swept(model, windows, p), p)
    x0, squares = fit_states(model, windows, model.starts(windows, p), p)
    for _ in range(REFRESHED):
        moved, _, better = escape_bad_starts(model, windows, p, x0, squares)
        if not better.any():
            break
        part = windows.some(np.flatnonzero(better).tolist())
        x0 = moved
        x0[better], squares[better] = fit_states(model, part, moved[better], p)
    return x0, squares


def free_runs(model: Model, windows: Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Initial states [w, n] that fit the first rows of each window alone, and the squared errors [w] of all of it."""
    first = windows.beginnings(FIRST_ROWS)
    x0 = model.starts(first, p)
    for _ in range(_MISFITS):
        x0, _ = predicted_states(model, first.missed(costs(model, first, x0, p, x0)[1]), p)
    _, squares = costs(model, windows, x0, p, x0)
    return x0, squares


def escape_bad_starts(
    model: Model, windows: Windows, p: np.ndarray, x0: np.ndarray, squares: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Initial states [w, n] of which those that a bad guess had caught are better, new guesses, and which are [w].

    The new guess is where the window before ends, from its fitted state, with what is measured or, where that is
    nearer, without: that is how far its neighbour is known.
    """
    if windows.from_rest:
        return x0, x0, np.zeros(windows.count, bool)
    if _rattles(model, windows, p):
        anew = _swept(model, windows, p)
    else:
        measured, joined = model.starts(windows, p, x0), model.joined(windows, p, x0)
        nearer = np.less(*(costs(model, windows, guess, p, guess)[0] for guess in (joined, measured)))
        anew = np.where(nearer[:, None], joined, measured)
    states, trial_squares = fit_states(model, windows, anew, p, _REFRESH_ROUNDS)
    better = trial_squares < _CAUGHT * squares
    return np.where(better[:, None], states, x0), anew, better


def _rattles(model: Model, windows: Windows, p: np.ndarray) -> bool:
    """Whether where windows begin in a gap is to be sought."""
    return bool(model.plant.gaps) and not windows.free_run and in_view(model.engine, p)


def _swept(model: Model, windows: Windows, p: np.ndarray) -> np.ndarray:
    """Initial states [w, n] of windows in which something rattles, one window after the other: each is guessed where
    the one before ends, or anywhere in the gap."""
    x0 = np.zeros((windows.count, model.plant.n))
    for level in range(windows.levels.max() + 1):
        own = np.flatnonzero(windows.levels == level)
        both = np.union1d(own - (level > 0), own)
        joined = model.joined(windows.some(both.tolist()), p, x0[both])[np.searchsorted(both, own)]
        part = windows.some(own.tolist())
        x0[own] = _nearest(model, part, p, [joined, *model.anywhere(part, p, joined)])
    return x0


def _nearest(model: Model, windows: Windows, p: np.ndarray, guesses: Sequence[np.ndarray]) -> np.ndarray:
    """Initial states [w, n] fitted from that one of several guesses [w, n] from which each window is followed best.

    Impacts make a window steep: from a guess that is a little off its end is anywhere, and no descent finds back. What
    is fitted therefore begins with the first rows, which are not steep yet, and gets longer; guesses that follow these
    worse than others fall out.
    """
    shortest = min(end - first for _, first, end in windows.spans)
    lengths = [(max(FIRST_ROWS // 2, round(share * shortest)), count) for share, count in _LONGER]
    first = windows.beginnings(lengths[1][0])
    alive = _best(guesses, [costs(model, first, x0, p, x0)[1] for x0 in guesses], lengths[0][1])
    for rows, count in lengths[:-1]:
        part = windows.beginnings(rows)
        states, squares = zip(*(fit_states(model, part, x0, p, _BRIEFLY) for x0 in alive[:count]), strict=True)
        alive = _best(states, squares, count)
    return alive[0]


def _best(states: Sequence[np.ndarray], squares: Sequence[np.ndarray], count: int) -> list[np.ndarray]:
    """For each window the `count` of several states [w, n] of least squares [w], the best first."""
    order = np.argsort(squares, axis=0, kind="stable")[:count]
    return list(np.take_along_axis(np.array(states), order[..., None], axis=0))


def state_step(normal: Normal, damping: np.ndarray) -> np.ndarray:
    matrix = normal.xx.copy()
    diagonal = np.einsum("wii->wi", matrix)
    diagonal *= 1 + damping[:, None]
    return np.linalg.solve(matrix, normal.xe[..., None])[..., 0]
